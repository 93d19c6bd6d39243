"""The register map, version 3: one table for both sides of the wire.

32-bit values have the high word first. Input registers (FC04) report, holding registers (FC03/06/16/23) command.
Every scaling comes from :mod:`rigctl.scaling`.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling
from rigctl.device import PressureStage
from rigctl.errors import LimitError
from rigctl.limits import Configuration, Limits
from rigctl.packing import from_counts, to_counts
from rigctl.session import nearest
from rigctl.transport import SEQUENCES, CaptureBlock, SetpointBlock

MAGIC: Final = 0x4452  # "DR"
MAP_VERSION: Final = 3
UNIT: Final = 1

Value: TypeAlias = float | str
Type: TypeAlias = Literal["u16", "i16", "u32", "i32", "text"]
_WIDTH: Final[Mapping[str, int]] = {"u16": 1, "i16": 1, "u32": 2, "i32": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class Register:
    """One value: its address, type and the value of one count."""

    name: str
    address: int
    type: Type = "u16"
    scale: float = 1.0
    words: int = 1

    @property
    def end(self) -> int:
        return self.address + (self.words if self.type == "text" else _WIDTH[self.type])


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A range of registers that is read or written as one."""

    address: int
    count: int
    registers: tuple[Register, ...]
    writable: bool = False

    def encode(self, values: Mapping[str, Value]) -> list[int]:
        """Turn SI values into words; a value that the register cannot hold raises OverflowError."""
        words = [0] * self.count
        for register in self.registers:
            offset = register.address - self.address
            words[offset : register.end - self.address] = _encode(register, values[register.name])
        return words

    def decode(self, words: Sequence[int]) -> dict[str, Value]:
        """Turn words into SI values."""
        return {
            register.name: _decode(register, words[register.address - self.address : register.end - self.address])
            for register in self.registers
        }


def _encode(register: Register, value: Value) -> list[int]:
    if register.type == "text":
        raw = str(value).encode("ascii", "replace")[: 2 * register.words].ljust(2 * register.words, b"\0")
        return [int.from_bytes(raw[i : i + 2]) for i in range(0, len(raw), 2)]
    width = _WIDTH[register.type]
    count = round(float(value) / register.scale)
    whole = count.to_bytes(2 * width, signed=register.type.startswith("i"))
    return [int.from_bytes(whole[i : i + 2]) for i in range(0, 2 * width, 2)]


def _decode(register: Register, words: Sequence[int]) -> Value:
    raw = b"".join(word.to_bytes(2) for word in words)
    if register.type == "text":
        return raw.rstrip(b"\0").decode("ascii", "replace")
    count = int.from_bytes(raw, signed=register.type.startswith("i"))
    return count if register.scale == 1.0 else count * register.scale


def _limits(address: int) -> tuple[Register, ...]:
    position, motion = scaling.DISPLACEMENT_M, scaling.VELOCITY_M_S
    return (
        Register(name="position_min_m", address=address, type="i32", scale=position),
        Register(name="position_max_m", address=address + 2, type="i32", scale=position),
        Register(name="velocity_m_s", address=address + 4, type="u32", scale=motion),
        Register(name="acceleration_m_s2", address=address + 6, type="u32", scale=scaling.ACCELERATION_M_S2),
        Register(name="force_n", address=address + 8, type="u32", scale=scaling.FORCE_N),
        Register(name="current_min_a", address=address + 10, type="i16", scale=scaling.CURRENT_A),
        Register(name="current_max_a", address=address + 11, type="i16", scale=scaling.CURRENT_A),
        Register(name="temperature_max_degc", address=address + 12, type="i16", scale=scaling.TEMPERATURE_DEGC),
        Register(name="following_error_m", address=address + 13, type="u32", scale=position),
    )


IDENTITY: Final = Block(
    address=0x0000,
    count=0x20,
    registers=(
        Register(name="magic", address=0x00),
        Register(name="map_version", address=0x01),
        Register(name="vendor", address=0x02, type="text", words=8),
        Register(name="model", address=0x0A, type="text", words=8),
        Register(name="serial", address=0x12, type="text", words=6),
        Register(name="channel_count", address=0x18),
        Register(name="sample_rate_min_hz", address=0x19, scale=scaling.SAMPLE_RATE_HZ),
        Register(name="sample_rate_max_hz", address=0x1A, type="u32", scale=scaling.SAMPLE_RATE_HZ),
        Register(name="fifo_samples", address=0x1C),
        Register(name="capture_samples", address=0x1D),
        Register(name="capabilities", address=0x1E),
    ),
)
STATUS: Final = Block(
    address=0x0020,
    count=0x20,
    registers=(
        Register(name="state", address=0x20),
        Register(name="faults", address=0x21),
        Register(name="first_fault", address=0x22),
        Register(name="run_id", address=0x23),
        Register(name="arrived", address=0x24),
        Register(name="heartbeat", address=0x25),
        Register(name="command_acknowledged", address=0x26),
        Register(name="command_refused", address=0x27),  # the last command that had no effect
        Register(name="standing", address=0x28),  # faults whose cause persists: a reset has no effect
        Register(name="detector", address=0x29),  # the detector that acted first; 0: none
        Register(name="session", address=0x2A),  # of the host that commands the rig; 0: nobody
        Register(name="nonce", address=0x2B, type="u32"),  # of the claim that began the session
        Register(name="foreign", address=0x2D),  # commands refused: of another session, old, or too far ahead
        Register(name="pressure_stage", address=0x2E),  # 0: off, 1: low, 2: high
    ),
)
COUNTERS: Final = Block(
    address=0x0040,
    count=0x20,
    registers=(
        Register(name="fifo_level", address=0x40),
        Register(name="fifo_free", address=0x41),
        Register(name="underruns", address=0x42),
        Register(name="overruns", address=0x43),
        Register(name="last_accepted", address=0x44),
        Register(name="consumed", address=0x45, type="u32"),
        Register(name="sample_index", address=0x47, type="u32"),
        Register(name="capture_backlog", address=0x49),
        Register(name="crc_errors", address=0x4A),
        Register(name="duplicates", address=0x4B),
        Register(name="gaps", address=0x4C),
        Register(name="water_marks", address=0x4D),  # 1: the FIFO is below its low, 2: above its high water mark
    ),
)
ACTUALS: Final = Block(
    address=0x0060,
    count=0x20,
    registers=(
        Register(name="force_n", address=0x60, type="i32", scale=scaling.FORCE_N),
        Register(name="displacement_m", address=0x62, type="i32", scale=scaling.DISPLACEMENT_M),
        Register(name="current_a", address=0x64, type="i32", scale=scaling.CURRENT_A),
        Register(name="temperature_degc", address=0x66, type="i32", scale=scaling.TEMPERATURE_DEGC),
        Register(name="pressure_pa", address=0x68, type="i32", scale=scaling.PRESSURE_PA),
    ),
)
MACHINE_LIMITS: Final = Block(
    address=0x0080,
    count=0x20,
    registers=(
        *_limits(0x80),
        Register(name="low_velocity_m_s", address=0x90, type="u32", scale=scaling.VELOCITY_M_S),  # 0: no low pressure
        Register(name="low_force_n", address=0x92, type="u32", scale=scaling.FORCE_N),
    ),
)
CONTROL: Final = Block(
    address=0x0100,
    count=0x0A,
    writable=True,
    registers=(
        Register(name="control", address=0x100),
        Register(name="session", address=0x101),  # 0 with DISABLE: a stop, obeyed from anybody
        Register(name="run_id", address=0x102),
        Register(name="command", address=0x103),  # higher with every command; the rig acknowledges it
        Register(name="mode", address=0x104),
        Register(name="reset_key", address=0x105),
        Register(name="direct_displacement_m", address=0x106, type="i32", scale=scaling.DISPLACEMENT_M),
        Register(name="direct_current_a", address=0x108, type="i32", scale=scaling.CURRENT_A),
    ),
)
LEASE: Final = Block(  # written by the master, at least as often as the watchdog asks for
    address=0x0110,
    count=2,
    writable=True,
    registers=(Register(name="session", address=0x110), Register(name="heartbeat", address=0x111)),
)
CLAIM: Final = Block(
    address=0x0112, count=2, writable=True, registers=(Register(name="nonce", address=0x112, type="u32"),)
)
RELEASE: Final = Block(
    address=0x0114,
    count=2,
    writable=True,
    registers=(Register(name="session", address=0x114), Register(name="command", address=0x115)),
)
COMMAND_BLOCKS: Final = (CONTROL, LEASE, CLAIM, RELEASE)
CAPTURED_ADDRESS: Final = 0x202
RESET_KEY: Final = 0x5253
MODE_PROGRAM: Final = 0
MODE_DIRECT: Final = 1
MODE_JOG: Final = 2
CONFIGURATION: Final = Block(
    address=0x0120,
    count=0x20,
    writable=True,
    registers=(
        Register(name="sample_rate_hz", address=0x120, type="u32", scale=scaling.SAMPLE_RATE_HZ),
        Register(name="prefill_samples", address=0x122),
        Register(name="low_water_samples", address=0x123),
        Register(name="high_water_samples", address=0x124),
        Register(name="heartbeat_s", address=0x125, scale=scaling.TIME_S),
        *_limits(0x128),
        Register(name="pressure_stage", address=0x137),  # that HOLD switches on: 1: low, 2: high
        Register(name="further_axes", address=0x138),  # 1: captured samples have their channels; needs the capability
        Register(name="session", address=0x13E),
        Register(name="command", address=0x13F),
    ),
)
INPUT_BLOCKS: Final = (IDENTITY, STATUS, COUNTERS, ACTUALS, MACHINE_LIMITS)


def configuration_values(configuration: Configuration, *, session: int = 0, command: int = 0) -> dict[str, Value]:
    """Flatten a configuration, and the command that writes it, into the names of its registers."""
    own = {f.name: getattr(configuration, f.name) for f in fields(configuration) if f.name not in ("limits", "stage")}
    stage = {"pressure_stage": configuration.stage.value}
    return {**own, **stage, **asdict(configuration.limits), "session": session, "command": command}


def differing(kept: Sequence[int], written: Sequence[int]) -> list[str]:
    """Names of what a rig keeps other than it was written; whose command wrote it is not kept."""
    one, other = CONFIGURATION.decode(kept), CONFIGURATION.decode(written)
    return [name for name, value in one.items() if name not in ("session", "command") and value != other[name]]


def configuration_from(values: dict[str, Value]) -> Configuration:
    """Make a configuration of decoded registers; LimitError where it contradicts itself."""
    numbers = {name: float(value) for name, value in values.items()}
    counts = {name: int(numbers[name]) for name in ("prefill_samples", "low_water_samples", "high_water_samples")}
    stage = int(numbers["pressure_stage"])
    if stage not in (PressureStage.LOW.value, PressureStage.HIGH.value):
        raise LimitError(f"pressure_stage is {stage}: it must be 1 (low) or 2 (high)")
    return Configuration(
        sample_rate_hz=numbers["sample_rate_hz"],
        heartbeat_s=numbers["heartbeat_s"],
        limits=Limits(**{f.name: numbers[f.name] for f in fields(Limits)}),
        stage=PressureStage(stage),
        further_axes=bool(numbers["further_axes"]),
        **counts,
    )


# A sample on the wire, as on CAN: 32 bits where the resolution needs them, else 16.
_SETPOINT: Final = np.dtype([("displacement_m", ">i4"), ("current_a", ">i2")])
_CAPTURE: Final = np.dtype(
    [
        ("force_n", ">i4"),
        ("displacement_m", ">i4"),
        ("current_a", ">i2"),
        ("temperature_degc", ">i2"),
        ("pressure_pa", ">u2"),
    ]
)
BLOCK_SAMPLES: Final = 37  # 3 words each: FC23 writes at most 121 words
CAPTURE_SAMPLES: Final = 16  # 7 words each: FC23 reads at most 125 words

WRITE_HEADER: Final = Block(
    address=0x0200,
    count=10,
    writable=True,
    registers=(
        Register(name="sequence", address=0x200),
        Register(name="samples", address=0x201),
        Register(name="captured", address=0x202, type="u32"),
        Register(name="run_id", address=0x204),
        Register(name="session", address=0x205),
        Register(name="heartbeat", address=0x206),
        Register(name="flags", address=0x207),
        Register(name="crc", address=0x208, type="u32"),
    ),
)
WRITE_COUNT: Final = WRITE_HEADER.count + 3 * BLOCK_SAMPLES
END_OF_STREAM: Final = 1
READ_HEADER: Final = Block(
    address=0x0300,
    count=13,
    registers=(
        Register(name="state", address=0x300),
        Register(name="faults", address=0x301),
        Register(name="last_accepted", address=0x302),
        Register(name="fifo_free", address=0x303),
        Register(name="consumed", address=0x304, type="u32"),
        Register(name="first_index", address=0x306, type="u32"),
        Register(name="samples", address=0x308),  # see below
        Register(name="run_id", address=0x309),
        Register(name="session", address=0x30A),
        Register(name="crc", address=0x30B, type="u32"),
    ),
)
SAMPLES: Final = 0x00FF  # of the word `samples`: the count
BEAT: Final = 8  # and from this bit on seven bits of the rig's heartbeat
REFUSED: Final = 0x8000  # set where the last block was refused
READ_COUNT: Final = READ_HEADER.count + 7 * CAPTURE_SAMPLES


def _to_words(values: NDArray[np.float64], layout: np.dtype[np.void], lsb: Sequence[float]) -> list[int]:
    words: list[int] = to_counts(values, layout, lsb).view(">u2").tolist()
    return words


def _from_words(words: Sequence[int], layout: np.dtype[np.void], lsb: Sequence[float]) -> NDArray[np.float64]:
    return from_counts(np.array(words, dtype=">u2").view(layout), lsb)


def crc32(words: Sequence[int]) -> int:
    """CRC-32 (zlib's) over words, high byte first."""
    return zlib.crc32(np.array(words, dtype=">u2").tobytes())


def _with_crc(block: Block, values: Mapping[str, Value], body: list[int], turn: Sequence[int] = ()) -> list[int]:
    head = block.encode({**values, "crc": 0})
    head[-2:] = divmod(crc32([*head, *body, *turn]), 1 << 16)
    return head + body


def _checked(
    block: Block, words: Sequence[int], words_per_sample: int, turn: Sequence[int] = ()
) -> tuple[dict[str, Value], list[int]] | None:
    """Decode a window into header and samples; None where the CRC or the count is wrong."""
    head = block.decode(words[: block.count])
    count = int(head["samples"]) & SAMPLES
    body = list(words[block.count : block.count + count * words_per_sample])
    if len(body) != count * words_per_sample:
        return None
    if crc32([*words[: block.count - 2], 0, 0, *body, *turn]) != head["crc"]:
        return None
    return head, body


def encode_write(block: SetpointBlock | None, run_id: int, captured: int, *, session: int, heartbeat: int) -> list[int]:
    """Words of the write window: one block of set-points (or none) and the number of samples captured so far."""
    samples, number = (0, 0) if block is None else (block.samples, block.sequence)
    body: list[int] = []
    if block is not None:
        body = _to_words(np.column_stack([block.displacement_m, block.current_a]), _SETPOINT, scaling.SETPOINT)
    values: dict[str, Value] = {
        "sequence": number % SEQUENCES,
        "samples": samples,
        "captured": captured,
        "run_id": run_id,
        "session": session,
        "heartbeat": heartbeat,
        "flags": END_OF_STREAM if block is not None and block.end_of_stream else 0,
    }
    return _with_crc(WRITE_HEADER, values, body, _turn(number))


@dataclass(frozen=True, slots=True, kw_only=True)
class WriteWindow:
    """The decoded write window."""

    run_id: int
    session: int
    captured: int
    heartbeat: int
    block: SetpointBlock | None


def _turn(number: int) -> tuple[int]:
    """The part of a block's number that does not travel: the check covers it too."""
    return (number // SEQUENCES & 0xFFFF,)


def decode_write(words: Sequence[int], *, following: int) -> WriteWindow | None:
    """Read the write window; None where it is damaged. The block's number is the one nearest to `following`."""
    number = nearest(words[0], following, SEQUENCES) if words[1] & SAMPLES else 0
    opened = _checked(WRITE_HEADER, words, 3, _turn(number))
    if opened is None:
        return None
    head, body = opened
    block = None
    if body:
        values = _from_words(body, _SETPOINT, scaling.SETPOINT)
        block = SetpointBlock(
            run_id=int(head["run_id"]),
            sequence=number,
            displacement_m=values[:, 0],
            current_a=values[:, 1],
            end_of_stream=bool(int(head["flags"]) & END_OF_STREAM),
        )
    return WriteWindow(
        run_id=int(head["run_id"]),
        session=int(head["session"]),
        captured=int(head["captured"]),
        heartbeat=int(head["heartbeat"]),
        block=block,
    )


def encode_read(head: Mapping[str, Value], capture: CaptureBlock, refused: bool, heartbeat: int = 0) -> list[int]:
    """Words of the read window: the rig's state, what it accepted, and captured samples."""
    values: dict[str, Value] = {
        **head,
        "first_index": capture.first_index,
        "samples": capture.samples | heartbeat << BEAT | (REFUSED if refused else 0),
        "run_id": capture.run_id,
    }
    words = _with_crc(READ_HEADER, values, _to_words(capture.values, _CAPTURE, scaling.CAPTURE))
    return words + [0] * (READ_COUNT - len(words))


def decode_read(words: Sequence[int]) -> tuple[dict[str, Value], CaptureBlock, bool] | None:
    """Read the read window: header, captured samples, last block refused or not; None where damaged."""
    opened = _checked(READ_HEADER, words, 7)
    if opened is None:
        return None
    head, body = opened
    capture = CaptureBlock(
        run_id=int(head["run_id"]),
        first_index=int(head["first_index"]),
        values=_from_words(body, _CAPTURE, scaling.CAPTURE),
    )
    return head, capture, bool(int(head["samples"]) & REFUSED)
