"""The simulated rig on CAN, classic or FD: frames in, frames out, one loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TypeAlias

import can
import numpy as np
from numpy.typing import NDArray

from rigctl import can_frames as frames
from rigctl import can_further, scaling, sdo
from rigctl import modbus_map as table
from rigctl.can_wire import is_ours
from rigctl.device import Control, Fault
from rigctl.errors import LimitError
from rigctl.loopback_can import LoopbackBus
from rigctl.session import NOBODY
from rigctl.transport import SetpointBlock
from sim_rig.errors import RequestRefused
from sim_rig.faults import FaultKind
from sim_rig.faulty_wire import FaultyWire, flip
from sim_rig.registers import RegisterDevice
from sim_rig.rig import SimulatedRig

TICK_S = 0.004
STATUS_S = 0.01
HEALTH_S = 0.1
WINDOW, FD_WINDOW = 512, 2048  # most captured samples sent and not acknowledged
FURTHER = slice(len(scaling.CAPTURE), None)  # columns of the further axes
AGAIN_S = 0.5  # without an acknowledgement samples are sent again, then after twice the time, and so on


Frame: TypeAlias = tuple[int, bytes]


class CanDevice:
    """Translates frames to calls of the rig: `take` accepts one frame, `give` returns the frames that are due."""

    def __init__(self, rig: SimulatedRig, now: Callable[[], float], *, fd: bool) -> None:
        self._rig, self._now, self._fd = rig, now, fd
        self._registers = RegisterDevice(rig)
        self._staged: dict[int, int] = {}
        self._parts: dict[int, bytes] = {}
        self._refused, self._direct = False, b""
        self._sent, self._run_id, self._moved_at, self._again_s = 0, -1, now(), AGAIN_S
        self._status_at = self._health_at = float("-inf")
        self._last_status = b""
        self._out: list[tuple[int, bytes]] = []
        self._starts, self._nmt, self._beat_at = 0, frames.PRE_OPERATIONAL, float("-inf")
        self._told = Fault.NONE
        self._wires = [FaultyWire(rig.faults, now, self._damage, seed=k) for k in range(2)] if rig.faults else []

    def take(self, number: int, data: bytes) -> None:
        """Accept one frame of the host; the answer is in the next `give`."""
        if self._wires:
            self._wires[0].put((number, data))
        else:
            self._obey(number, data)

    def _damage(self, frame: Frame, random: np.random.Generator) -> Frame | None:
        number, data = frame
        captured = (frames.CAPTURE, can_further.FURTHER[0]) if self._fd else ()
        checked = (frames.CONTROL, frames.STREAM, frames.COMMIT, *captured)
        return (number, flip(data, 0, random)) if number in checked else None

    def _obey(self, number: int, data: bytes) -> None:
        if number == frames.CONTROL:
            self._control(data)
        elif number == frames.DIRECT and len(data) == 8:
            self._direct = data  # the command that follows it carries the check over both
        elif number == frames.STREAM and self._fd:
            self._stream_fd(data)
        elif number == frames.STREAM and len(data) == 8:
            self._parts[int.from_bytes(data[:2], "little")] = data[2:]
        elif number == frames.COMMIT and len(data) == 8:
            self._commit(data)
        elif number == frames.SDO_REQUEST:
            request = sdo.unpack(data)
            if request is not None:
                self._serve(request)
        elif number == frames.HOST_HEARTBEAT:
            beat = frames.unpack_host_heartbeat(data)
            if beat is not None:
                self._rig.beat(*beat)
        elif number == frames.NMT and data[1:] in (bytes([frames.NODE]), bytes([0])):
            self._manage(data[0])

    def _manage(self, order: int) -> None:
        if order == frames.NMT_START:
            self._nmt, self._beat_at = frames.OPERATIONAL, float("-inf")
        elif order == frames.NMT_STOP:
            self._nmt = frames.STOPPED
            self._rig.stop()

    def give(self) -> list[Frame]:
        """Return the frames that are due: answers, status, health, captured samples."""
        if not self._wires:
            return self._due()
        for frame in self._wires[0].take():
            self._obey(*frame)
        for frame in self._due():
            self._wires[1].put(frame)
        return self._wires[1].take()

    def _due(self) -> list[Frame]:
        now = self._now()
        self._send_heartbeat(now)
        self._send_captured(now)
        self._send_status(now)
        if now - self._health_at >= HEALTH_S:
            self._health_at = now
            status = self._rig.status()
            data = frames.pack_health(status.temperature_degc, status.pressure_pa, status.consumed)
            self._out.append((frames.HEALTH, data))
        out, self._out = self._out, []
        return out

    def _control(self, data: bytes) -> None:
        found = frames.unpack_control(data, self._direct)
        if found is None:
            self._rig.crc_errors += 1
            return
        with suppress(RequestRefused):  # the host reads the refusal in a register
            if found.mode in (frames.MODE_TRAVEL, frames.MODE_JOG):
                displacement_m, current_a, number = frames.unpack_direct(self._direct)
                if number != found.number:
                    return
                if found.mode == frames.MODE_JOG:
                    self._registers.jog(displacement_m, found.session, number)
                else:
                    self._registers.direct(displacement_m, current_a, found.session, number)
            else:
                self._registers.command(Control(found.control), found.run_id, found.session, found.number)

    def _stream_fd(self, data: bytes) -> None:
        found = frames.unpack_stream_fd(data, following=self._rig.controller.fifo.following)
        if found is None or not self._rig.master.owns(found.session):
            self._rig.crc_errors += found is None
            self._refused = True
            return
        self._accept(found.rows, found.sequence, found.run_id, found.end)

    def _commit(self, data: bytes) -> None:
        fifo, session = self._rig.controller.fifo, self._rig.master.session
        found = frames.unpack_stream(self._parts, data, fifo.run_id, session=session, following=fifo.following)
        self._parts = {}
        if found is None or session == NOBODY:
            self._rig.crc_errors += 1
            self._refused = True
            return
        rows, sequence, end = found
        self._accept(rows, sequence, fifo.run_id, end)

    def _accept(self, rows: NDArray[np.float64], sequence: int, run_id: int, end: bool) -> None:
        block = SetpointBlock(
            run_id=run_id,
            sequence=sequence,
            displacement_m=rows[:, 0],
            current_a=rows[:, 1],
            end_of_stream=end,
        )
        self._refused = not self._rig.controller.accept(block)

    def _serve(self, request: sdo.Sdo) -> None:
        try:
            value = self._upload(request) if request.kind == sdo.UPLOAD else self._download(request)
            kind = sdo.UPLOADED if request.kind == sdo.UPLOAD else sdo.DOWNLOADED
        except KeyError:
            kind, value = sdo.ABORT, sdo.NO_SUCH_OBJECT
        except (RequestRefused, LimitError, OverflowError):
            kind, value = sdo.ABORT, sdo.NOT_IN_THIS_STATE
        if request.address == table.CAPTURED_ADDRESS:
            self._send_status(self._now(), at_once=True)  # before the answer, after which the host expects no status
        self._out.append((frames.SDO_ANSWER, sdo.Sdo(kind=kind, address=request.address, value=value).pack()))

    def _upload(self, request: sdo.Sdo) -> int:
        if request.address >= sdo.ERROR_HISTORY:
            return self._history(request.address - sdo.ERROR_HISTORY)
        for block, words in self._registers.read(request.address, 2):
            at = request.address - block.address
            if at >= 0:
                high, low = (*words[at : at + 2], 0)[:2]
                return high << 16 | low
        raise KeyError(request.address)

    def _history(self, sub: int) -> int:
        history = self._rig.controller.history
        if sub > len(history):
            raise KeyError(sub)
        return frames.error_entry(history[sub - 1]) if sub else len(history)

    def _download(self, request: sdo.Sdo) -> int:
        if request.address == table.CAPTURED_ADDRESS:
            self._acknowledge(request.value)
            return 0
        if request.address in (table.LEASE.address, table.CLAIM.address, table.RELEASE.address):
            self._registers.write(request.address, list(divmod(request.value, 0x10000)))
            return 0
        block = table.CONFIGURATION
        if not block.address <= request.address < block.address + block.count:
            raise KeyError(request.address)
        self._staged[request.address] = request.value
        if request.address + 2 >= block.address + block.count:  # the last pair applies the whole configuration
            pairs = [self._staged.get(block.address + k) for k in range(0, block.count, 2)]
            if None in pairs:
                raise RequestRefused("a part of the configuration is missing")
            self._registers.write(block.address, [word for pair in pairs for word in divmod(pair or 0, 0x10000)])
        return 0

    def _acknowledge(self, word: int) -> None:
        """Drop captured samples that the host has, or send again from the first that it has not."""
        store = self._rig.controller.store
        captured = frames.captured_from(word, store.run_id, store.first_index)
        before = store.first_index
        if captured is not None:
            self._rig.exchange(None, store.run_id, captured, store.session, frames.FD_CAPTURE)
            if word & frames.AGAIN:
                self._sent = store.first_index
        if store.first_index != before:
            self._moved_at, self._again_s = self._now(), AGAIN_S

    def _send_captured(self, now: float) -> None:
        store = self._rig.controller.store
        if store.run_id != self._run_id or self._sent < store.first_index:
            self._run_id, self._sent, self._moved_at = store.run_id, store.first_index, now
        if self._sent > store.first_index and now - self._moved_at > self._again_s:
            self._sent, self._moved_at, self._again_s = store.first_index, now, 2 * self._again_s
        ahead = self._sent - store.first_index
        values = store.beyond(ahead, FD_WINDOW if self._fd else WINDOW)
        if not values.shape[0]:
            return
        packed = [(frames.pack_capture_fd if self._fd else frames.pack_capture, slice(None))]
        if self._rig.controller.configuration.further_axes:
            packed.append((can_further.pack_further_fd if self._fd else can_further.pack_further, FURTHER))
        for pack, channels in packed:
            self._out.extend(pack(values[:, channels], self._sent, run_id=store.run_id))
        self._sent += values.shape[0]

    def _send_heartbeat(self, now: float) -> None:
        if self._starts != self._rig.starts:
            self._starts, self._nmt = self._rig.starts, frames.PRE_OPERATIONAL
            self._parts, self._staged, self._run_id = {}, {}, -1
            self._out.append((frames.RIG_HEARTBEAT, bytes([frames.BOOT_UP])))
        if now - self._beat_at >= frames.HEARTBEAT_S and not self._rig.faults.has_begun(FaultKind.HEARTBEAT):
            self._beat_at = now
            self._out.append((frames.RIG_HEARTBEAT, bytes([self._nmt])))
        controller = self._rig.controller
        if controller.first_fault is not self._told:
            self._told = controller.first_fault
            self._out.append((frames.EMERGENCY, frames.pack_emergency(self._told, controller.sample_index)))

    def _send_status(self, now: float, *, at_once: bool = False) -> None:
        controller = self._rig.controller
        data = frames.pack_status(
            frames.StatusFrame(
                state=controller.state.value,
                arrived=controller.arrived,
                refused=self._refused,
                faults=int(controller.faults),
                fifo_level=controller.fifo.level,
                last_accepted=controller.fifo.last_accepted,
                stage=controller.stage,
                session=self._rig.master.session,
                run_id=controller.fifo.run_id,
            )
        )
        if at_once or data[:4] != self._last_status[:4] or now - self._status_at >= STATUS_S:
            self._status_at, self._last_status = now, data
            self._out.append((frames.STATUS, data))


def serve_can(
    rig: SimulatedRig, bus: can.BusABC, *, fd: bool, now: Callable[[], float], stop: Callable[[], bool]
) -> None:
    """Serve a rig on a bus until `stop` says so."""
    device = CanDevice(rig, now, fd=fd)
    while not stop():
        message = bus.recv(TICK_S)
        while message is not None:
            if is_ours(message):
                device.take(message.arbitration_id, bytes(message.data))
            message = bus.recv(0.0)
        rig.tick()
        _send(bus, device.give(), fd)


def _send(bus: can.BusABC, out: Sequence[tuple[int, bytes]], fd: bool) -> None:
    messages = [
        can.Message(arbitration_id=number, data=data, is_extended_id=False, is_fd=fd, bitrate_switch=fd)
        for number, data in out
    ]
    if isinstance(bus, LoopbackBus):
        bus.send_all(messages)
    else:
        for message in messages:
            bus.send(message, timeout=0.1)
