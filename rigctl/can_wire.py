"""A rig over CAN, classic or FD: set-points and captured samples in frames of their own, registers by SDO."""

from __future__ import annotations

import errno
import secrets
from collections.abc import Callable, Sequence

import can
import numpy as np
from numpy.typing import NDArray

from rigctl import can_frames as frames
from rigctl import can_further, scaling, sdo
from rigctl import modbus_map as table
from rigctl.bus_load import check_bus
from rigctl.can_arrived import Arrived
from rigctl.can_blocks import BlockCount
from rigctl.clock import Clock, SystemClock
from rigctl.device import Control, Fault, RigState
from rigctl.errors import IdentityError, RequestDenied, TransportError, TransportTimeout
from rigctl.limits import Configuration
from rigctl.loopback_can import LoopbackBus
from rigctl.registers import check_identity, identity_from, status_from
from rigctl.session import NOBODY, Session
from rigctl.transport import HEARTBEATS, SEQUENCES, CaptureBlock, Identity, Reply, SetpointBlock, Status

FULL_S = 0.1  # for a full queue of the driver
BACK_OFF_S = 0.001
SLICE_S = 0.02  # most time of one wait for a frame
ACKNOWLEDGE_S = 0.1  # before the rig is asked once more what it has
SDO_S = 0.06  # before an unanswered request is sent again


def is_ours(message: can.Message) -> bool:
    """A data frame with an 11-bit identifier: other devices may use longer ones, and a bus reports errors as frames."""
    return not (message.is_extended_id or message.is_error_frame or message.is_remote_frame)


class CanTransport:
    """One bus to one rig. `open_bus` opens it when it is needed: nothing is sent before the first call."""

    capture_samples = SEQUENCES  # the rig sends them at once: an exchange returns all that have arrived

    def __init__(
        self,
        url: str,
        open_bus: Callable[[], can.BusABC],
        *,
        fd: bool,
        bitrate: float = 1e6,
        data_bitrate: float = 5e6,
        clock: Clock | None = None,
    ) -> None:
        self.url = url
        self._open, self._fd, self._rates = open_bus, fd, (bitrate, data_bitrate)
        self._units, self._unit_samples = 1, frames.FD_BLOCK if fd else frames.CLASSIC_BLOCK
        self._clock = clock or SystemClock()
        self._bus: can.BusABC | None = None
        self._session, self._nonce = Session(), secrets.randbits(32)
        self._sdo: dict[int, sdo.Sdo] = {}
        self._status: frames.StatusFrame | None = None
        self._pressure_pa = 0.0
        self._rig_beats, self._rig_state = 0, frames.BOOT_UP
        self._told_at = float("-inf")
        self._further_axes = False
        self._begin_run(0)

    @property
    def session(self) -> int:
        return self._session.number

    def _begin_run(self, run_id: int) -> None:
        """Reset the counters for another run."""
        self._run_id = run_id
        self._status = None  # it counts the blocks of the run before
        self._captured, self._further = Arrived(len(scaling.CAPTURE)), Arrived(len(scaling.FURTHER))
        self._half: bytes | None = None
        self._parts: dict[int, bytes] = {}  # frames of the further axes of a sample
        self._skipped = self._asked_again = False  # a captured sample was lost, later ones have arrived
        self._unanswered: int | None = None  # a block that was sent and not answered yet
        self._blocks = BlockCount(units=self._units, unit_samples=self._unit_samples)
        self._lost_power = False

    def identify(self, deadline_s: float) -> Identity:
        ends = self._clock.now() + deadline_s
        self._start(ends)
        try:
            head = self._read_block(table.IDENTITY, ends)
        except RequestDenied as error:
            raise IdentityError(f"{self.url}: a foreign device, not a damper rig ({error})") from error
        check_identity(self.url, head)
        return identity_from(head, self._read_block(table.MACHINE_LIMITS, ends))

    @property
    def block_samples(self) -> int:
        return self._units * self._unit_samples

    def _size_blocks(self, high_water_samples: int) -> None:
        """Make blocks a third of the high-water mark: few round trips, since each is slow on a busy computer."""
        third = max(high_water_samples // 3, 1)
        if self._fd:
            self._units = max(third // frames.FD_BLOCK, 1)
        else:
            self._unit_samples = min(frames.CLASSIC_BLOCK, third)

    def _start(self, ends: float) -> None:
        """Handshake: wait for the rig's heartbeat before the first request."""
        seen = self._rig_beats
        while self._rig_beats == seen or self._rig_state != frames.OPERATIONAL:
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: {self._reason_for_silence(self._rig_beats > seen)}")
            self._send([(frames.NMT, bytes([frames.NMT_START, frames.NODE]))])
            self._receive(SLICE_S)

    def _reason_for_silence(self, rig_speaks: bool) -> str:
        if not rig_speaks:
            return "the rig does not answer"
        return "the rig sends frames and does not answer requests" + (
            ": is it on classic CAN? Leave out fd=true" if self._fd else ""
        )

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        ends = self._clock.now() + deadline_s
        bitrate, data_bitrate = self._rates
        check_bus(
            configuration.sample_rate_hz,
            fd=self._fd,
            bitrate=bitrate,
            data_bitrate=data_bitrate,
            further_axes=configuration.further_axes,
        )
        own = self._session
        values = table.configuration_values(configuration, session=own.number, command=own.next_command())
        words = table.CONFIGURATION.encode(values)
        self._write(table.CONFIGURATION.address, words, ends)
        wrong = table.differing(self._read(table.CONFIGURATION.address, len(words), ends), words)
        if wrong:
            raise IdentityError(f"{self.url}: the rig did not keep its configuration: {', '.join(wrong)}")
        self._size_blocks(configuration.high_water_samples)
        self._further_axes = configuration.further_axes

    def claim(self, deadline_s: float) -> int:
        ends = self._clock.now() + deadline_s
        self._write(table.CLAIM.address, table.CLAIM.encode({"nonce": self._nonce}), ends)
        status, values = self._read_status(ends)
        if values["nonce"] != self._nonce or status.session == NOBODY:
            raise TransportError(f"{self.url}: the rig has given the session to another host")
        if status.session != self._session.number:
            self._session = Session(number=status.session)
        return status.session

    def release(self, deadline_s: float) -> None:
        ends = self._clock.now() + deadline_s
        own, self._nonce = self._session, secrets.randbits(32)
        if own.claimed:
            try:
                self._write(table.RELEASE.address, [own.number, own.next_command()], ends)
            except RequestDenied:
                if self._read_status(ends)[0].session == own.number:
                    raise
            self._session = Session()

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        order = self._order(control, run_id)
        self._send([(frames.CONTROL, order.pack())])
        return self._acknowledged(order.number, ends)

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        return self._move(displacement_m, current_a, frames.MODE_TRAVEL, deadline_s)

    def jog(self, displacement_m: float, deadline_s: float) -> Status:
        return self._move(displacement_m, 0.0, frames.MODE_JOG, deadline_s)

    def _move(self, displacement_m: float, current_a: float, mode: int, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        order = self._order(Control.HOLD, 0, mode=mode)
        try:
            data = frames.pack_direct(displacement_m, current_a, order.number)
        except OverflowError as error:
            raise RequestDenied(f"{self.url}: direct set-point {displacement_m} m does not fit the frame") from error
        self._send([(frames.DIRECT, data), (frames.CONTROL, order.pack(data))])
        return self._acknowledged(order.number, ends)

    def _order(self, control: Control, run_id: int, *, mode: int = frames.MODE_PROGRAM) -> frames.ControlFrame:
        own = self._session
        return frames.ControlFrame(
            control=int(control), mode=mode, session=own.number, run_id=run_id, number=own.next_command()
        )

    def _acknowledged(self, number: int, ends: float) -> Status:
        while True:
            status, values = self._read_status(ends)
            if values["command_acknowledged"] == number:
                return status
            if values["command_refused"] == number or status.session != self._session.number:
                raise RequestDenied(f"{self.url}: the rig refused the command in {status.state.name}")

    def stop(self, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        stop = frames.ControlFrame(control=int(Control.DISABLE), session=NOBODY, run_id=0, number=0)
        self._send([(frames.CONTROL, stop.pack())])
        return self._read_status(ends)[0]

    def status(self, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        if self._session.claimed:
            self._write(table.LEASE.address, [self._session.number, self._session.next_heartbeat()], ends)
        return self._read_status(ends)[0]

    def error_history(self, deadline_s: float) -> list[Fault]:
        """Read which faults the rig had, the newest first, whatever was reset since."""
        ends = self._clock.now() + deadline_s
        count = self._ask([sdo.Sdo(kind=sdo.UPLOAD, address=sdo.ERROR_HISTORY)], ends)[0].value
        wanted = [sdo.Sdo(kind=sdo.UPLOAD, address=sdo.ERROR_HISTORY + 1 + k) for k in range(count)]
        return [Fault(1 << (answer.value >> 16)) for answer in self._ask(wanted, ends)]

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        ends = self._clock.now() + deadline_s
        if run_id != self._run_id:
            self._begin_run(run_id)
        self._captured.drop(captured)
        self._further.drop(captured)
        self._asked_again |= self._skipped
        word = frames.captured_word(captured, run_id, again=self._skipped)
        request = sdo.Sdo(kind=sdo.DOWNLOAD, address=table.CAPTURED_ADDRESS, value=word)
        self._sdo.pop(request.address, None)
        on_its_way = block is not None and block.sequence == self._unanswered
        pieces = [] if on_its_way else self._pack(block)
        self._unanswered = None if block is None else block.sequence
        while True:
            self._send([*pieces, (frames.SDO_REQUEST, request.pack())])
            refused = not self._await_answer(block, request.address, min(ends, self._clock.now() + ACKNOWLEDGE_S))
            if self._status is not None and request.address in self._sdo:
                break
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: no answer before the deadline")
            pieces = []  # on their way; a lost one is sent with the next call
        self._unanswered = None
        return self._reply(refused)

    def _pack(self, block: SetpointBlock | None) -> list[tuple[int, bytes]]:
        if block is None:
            return []
        rows = np.column_stack([block.displacement_m, block.current_a])
        first = self._blocks.first_unit(block)
        pack = frames.pack_stream_fd if self._fd else frames.pack_stream
        return pack(rows, first, block.run_id, block.end_of_stream, session=self._session.number)

    def _await_answer(self, block: SetpointBlock | None, address: int, ends: float) -> bool:
        """Receive until the rig has acknowledged the block; False where it was refused or lost."""
        while self._clock.now() < ends:
            self._receive(SLICE_S)
            if address in self._sdo and self._concerns_run(self._status):  # which acknowledges the block comes first
                break
        if self._status is not None and self._concerns_run(self._status):
            self._blocks.note(self._status.last_accepted)
        return block is None or self._blocks.has(block)

    def _concerns_run(self, status: frames.StatusFrame | None) -> bool:
        """Whether what a status counts is of the run that is being played, and not of a former one."""
        return status is not None and status.run_id == self._run_id & 0xF

    def _takes(self, status: frames.StatusFrame) -> bool:
        """Whether a status is news: one of this session and a former run is late, once there is another one."""
        late = status.session == self._session.number & 0xF and not self._concerns_run(status)
        return self._status is None or not late

    def _reply(self, refused: bool) -> Reply:
        assert self._status is not None
        status = self._status
        first, values = self._whole_samples()
        return Reply(
            state=RigState(status.state),
            faults=Fault(status.faults),
            last_accepted=self._blocks.last_block,
            fifo_free=0,
            consumed=max(self._blocks.samples - status.fifo_level, 0) if self._concerns_run(status) else 0,
            refused=refused,
            heartbeat=self._rig_beats % HEARTBEATS,
            owned=status.session == self._session.number & 0xF,
            capture=CaptureBlock(run_id=0 if self._lost_power else self._run_id, first_index=first, values=values),
        )

    def _whole_samples(self) -> tuple[int, NDArray[np.float64]]:
        """Index of the first sample, and the samples of which everything has arrived."""
        values = self._captured.rows
        first = self._captured.next - values.shape[0]
        if not self._further_axes:
            return first, values
        count = max(min(self._captured.next, self._further.next) - first, 0)
        return first, np.hstack([values[:count], self._further.rows[:count]])

    def close(self) -> None:
        if self._bus is not None:
            self._bus.shutdown()
            self._bus, self._unanswered = None, None

    def _send(self, messages: Sequence[tuple[int, bytes]]) -> None:
        if self._session.claimed and self._clock.now() - self._told_at >= frames.HEARTBEAT_S:
            self._told_at, own = self._clock.now(), self._session
            beat = frames.pack_host_heartbeat(own.number, own.next_heartbeat())
            messages = [*messages, (frames.HOST_HEARTBEAT, beat)]
        made = [
            can.Message(arbitration_id=number, data=data, is_extended_id=False, is_fd=self._fd, bitrate_switch=self._fd)
            for number, data in messages
        ]
        try:
            bus = self._connected()
            if isinstance(bus, LoopbackBus):
                bus.send_all(made)
            else:
                for message in made:
                    self._send_one(bus, message)
        except (can.CanError, OSError, ValueError) as error:
            self.close()
            raise TransportError(f"{self.url}: {' '.join(str(error).split())}") from error

    def _send_one(self, bus: can.BusABC, message: can.Message) -> None:
        """Send a frame; a driver whose queue is full (ENOBUFS on SocketCAN) is given time to empty it."""
        ends = self._clock.now() + FULL_S
        while True:
            try:
                bus.send(message, timeout=FULL_S)
                return
            except can.CanOperationError as error:
                if error.error_code != errno.ENOBUFS or self._clock.now() >= ends:
                    raise
                self._clock.sleep(BACK_OFF_S)

    def _connected(self) -> can.BusABC:
        if self._bus is None:
            self._bus = self._open()
        return self._bus

    def _receive(self, timeout_s: float) -> None:
        """Wait for a frame, then receive all that are there."""
        try:
            message = self._connected().recv(timeout_s)
            while message is not None:
                if is_ours(message):
                    self._dispatch(message.arbitration_id, bytes(message.data))
                message = self._connected().recv(0.0)
        except (can.CanError, OSError, ValueError) as error:
            self.close()
            raise TransportError(f"{self.url}: {' '.join(str(error).split())}") from error

    def _dispatch(self, number: int, data: bytes) -> None:
        if number == frames.STATUS and len(data) == 8:
            status = frames.unpack_status(data)
            self._status = status if self._takes(status) else self._status
        elif number == frames.HEALTH and len(data) == 8:
            self._pressure_pa = frames.unpack_health(data)[1]
        elif number == frames.RIG_HEARTBEAT and len(data) == 1:
            self._rig_beats, self._rig_state = self._rig_beats + 1, data[0]
            self._lost_power |= data[0] == frames.BOOT_UP
        elif number == frames.SDO_ANSWER:
            answer = sdo.unpack(data)
            if answer is not None:
                self._sdo[answer.address] = answer
                self._note_acknowledged(answer)
        elif number == frames.CAPTURE and self._fd:
            self._append(self._captured, frames.unpack_capture_fd(data, run_id=self._run_id))
        elif number == frames.CAPTURE and len(data) == 8:
            self._half = data
        elif number == frames.CAPTURE_B and self._half is not None and len(data) == 8:
            following = self._captured.next
            found = frames.unpack_capture(self._half, data, self._pressure_pa, run_id=self._run_id, following=following)
            self._append(self._captured, found)
        elif number in can_further.FURTHER and self._further_axes:
            self._dispatch_further(number, data)

    def _dispatch_further(self, number: int, data: bytes) -> None:
        following = self._further.next
        if self._fd:
            self._append(self._further, can_further.unpack_further_fd(data, run_id=self._run_id, following=following))
            return
        self._parts[number] = data
        if number == can_further.FURTHER[-1]:
            found = can_further.unpack_further(self._parts, run_id=self._run_id, following=following)
            self._append(self._further, found)

    def _note_acknowledged(self, answer: sdo.Sdo) -> None:
        """Note that the rig has an acknowledgement: later frames were sent after it."""
        if answer.address == table.CAPTURED_ADDRESS and self._asked_again:
            self._skipped = self._asked_again = False

    def _append(self, arrived: Arrived, found: tuple[int, NDArray[np.float64]] | None) -> None:
        """Append samples that follow the last one; after a gap the rig sends again from the acknowledged one."""
        if found is not None:
            self._skipped |= not arrived.add(*found)

    def _read_block(self, block: table.Block, ends: float) -> dict[str, table.Value]:
        return block.decode(self._read(block.address, block.count, ends))

    def _read_status(self, ends: float) -> tuple[Status, dict[str, table.Value]]:
        values: dict[str, table.Value] = {}
        for block in (table.STATUS, table.COUNTERS, table.ACTUALS):
            values.update(self._read_block(block, ends))
        return status_from(values), values

    def _read(self, address: int, count: int, ends: float) -> list[int]:
        requests = [sdo.Sdo(kind=sdo.UPLOAD, address=address + k) for k in range(0, count, 2)]
        answers = self._ask(requests, ends)
        words = [word for answer in answers for word in divmod(answer.value, 0x10000)]
        return words[:count]

    def _write(self, address: int, words: list[int], ends: float) -> None:
        pairs = [(*words[k : k + 2], 0)[:2] for k in range(0, len(words), 2)]
        requests = [
            sdo.Sdo(kind=sdo.DOWNLOAD, address=address + 2 * k, value=high << 16 | low)
            for k, (high, low) in enumerate(pairs)
        ]
        self._ask(requests[:-1], ends)
        self._ask(requests[-1:], ends)  # the rig applies the configuration with the last pair

    def _ask(self, requests: list[sdo.Sdo], ends: float) -> list[sdo.Sdo]:
        """Send requests until every one is answered, or the deadline has come."""
        for request in requests:
            self._sdo.pop(request.address, None)
        while missing := [request for request in requests if request.address not in self._sdo]:
            if self._clock.now() >= ends:
                raise TransportTimeout(f"{self.url}: the rig does not answer")
            self._send([(frames.SDO_REQUEST, request.pack()) for request in missing])
            again = self._clock.now() + SDO_S
            while self._clock.now() < min(again, ends) and any(r.address not in self._sdo for r in missing):
                self._receive(SLICE_S)
        answers = [self._sdo[request.address] for request in requests]
        for answer in answers:
            if answer.kind == sdo.ABORT:
                reason = sdo.ABORT_TEXT.get(answer.value, f"code 0x{answer.value:08X}")
                raise RequestDenied(f"{self.url}: the rig refused: {reason}")
        return answers
