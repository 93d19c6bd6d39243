"""The register map and the frames as tables for the documentation."""

from __future__ import annotations

from rigctl import can_frames as frames
from rigctl import can_further, modbus_further
from rigctl import modbus_map as table

FURTHER = (
    "where `further_axes` asks for it; classic: two channels of a sample; FD: two samples with all of them and CRC-16",
    "two more channels (classic)",
)
FRAMES = (
    (frames.NMT, "host", "NMT", "start (1) or stop (2), node"),
    (frames.EMERGENCY, "rig", "emergency", "code, register, fault bit, sample index; code 0: it is over"),
    (
        frames.CONTROL,
        "host",
        "control",
        "command, mode (1: travel, 2: jog), session, run, command number, CRC-8; DISABLE with session 0 is a stop from "
        "anybody",
    ),
    (
        frames.STATUS,
        "rig",
        "status",
        "state, pressure stage, four bits of session and run, faults, FIFO level, last accepted block; every 10 ms and "
        "on change",
    ),
    (frames.HEALTH, "rig", "health", "temperature, supply pressure, samples played; every 100 ms"),
    (
        frames.DIRECT,
        "host",
        "direct set-point",
        "displacement, current, command number; has no effect before the control frame of the same number",
    ),
    (frames.STREAM, "host", "stream", "classic: one set-point; FD: up to nine with number, run, session and CRC-16"),
    (
        frames.COMMIT,
        "host",
        "block commit (classic)",
        "block number, count, end of stream, CRC-32 that begins with session and run",
    ),
    (frames.CAPTURE, "rig", "capture", "classic: force and current of a sample; FD: four whole samples with CRC-16"),
    (frames.CAPTURE_B, "rig", "capture B (classic)", "displacement and temperature of a sample"),
    *((identifier, "rig", f"further axes {k}", FURTHER[k > 0]) for k, identifier in enumerate(can_further.FURTHER)),
    (frames.SDO_REQUEST, "host", "SDO request", "two registers at 0x2000 + (address >> 8), sub-index address & 0xFF"),
    (frames.SDO_ANSWER, "rig", "SDO answer", "the same; object 0x1003 is the error history"),
    (frames.RIG_HEARTBEAT, "rig", "heartbeat", "NMT state, every 50 ms; 0 once after power-on"),
    (
        frames.HOST_HEARTBEAT,
        "host",
        "heartbeat",
        "NMT state, session, rising number; every 50 ms while the master talks",
    ),
)


def registers_as_markdown() -> str:
    """Table of all registers: address, name, type, value of one count, access."""
    blocks = (
        *table.INPUT_BLOCKS,
        *table.COMMAND_BLOCKS,
        table.CONFIGURATION,
        table.WRITE_HEADER,
        table.READ_HEADER,
        modbus_further.HEADERS[0],
    )
    lines = ["| address | name | type | one count is | access |", "|---|---|---|---|---|"]
    for block in blocks:
        access = "read, write" if block.writable else "read"
        for one in block.registers:
            kind = f"{one.words} words of text" if one.type == "text" else one.type
            worth = "" if one.type == "text" else f"{one.scale:g}"
            lines.append(f"| 0x{one.address:04X} | `{one.name}` | {kind} | {worth} | {access} |")
    return "\n".join(lines) + "\n"


def frames_as_markdown() -> str:
    """Table of all frames: identifier, sender, name, content."""
    lines = ["| COB-ID | from | frame | content |", "|---|---|---|---|"]
    lines += [f"| 0x{number:03X} | {sender} | {name} | {content} |" for number, sender, name, content in FRAMES]
    return "\n".join(lines) + "\n"
