"""A rig over Modbus TCP: FC23 writes a block of set-points and reads a block of captured samples."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Callable

from pymodbus import ModbusException
from pymodbus.client import ModbusTcpClient
from pymodbus.pdu import ModbusPDU

from rigctl import modbus_further
from rigctl import modbus_map as table
from rigctl.clock import Clock, SystemClock
from rigctl.device import Control, Fault, RigState
from rigctl.errors import IdentityError, RequestDenied, TransportError, TransportTimeout
from rigctl.limits import Configuration
from rigctl.registers import check_identity, identity_from, status_from
from rigctl.session import NOBODY, Session
from rigctl.transport import HEARTBEATS, CaptureBlock, Identity, Reply, SetpointBlock, Status

# A refusal of the rig itself, as opposed to a failure of the wire.
ILLEGAL = {1: "illegal function", 2: "illegal address", 3: "illegal value", 4: "device failure", 6: "busy"}


class ModbusTransport:
    """One connection to one rig; a failed call closes it, so that a late answer is not taken for the next one."""

    block_samples = table.BLOCK_SAMPLES
    capture_samples = table.CAPTURE_SAMPLES

    def __init__(
        self, host: str, port: int, *, clock: Clock | None = None, client: ModbusTcpClient | None = None
    ) -> None:
        logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # its errors arrive as exceptions
        self.url = f"modbus://{host}:{port}"
        self._clock = clock or SystemClock()
        self._client = client or ModbusTcpClient(host, port=port, retries=0, timeout=1.0)
        self._session = Session()
        self._nonce = secrets.randbits(32)
        self._further_axes = False

    @property
    def session(self) -> int:
        return self._session.number

    def identify(self, deadline_s: float) -> Identity:
        ends = self._clock.now() + deadline_s
        try:
            head = self._read_block(table.IDENTITY, ends)
        except RequestDenied as error:
            raise IdentityError(f"{self.url}: a foreign device, not a damper rig ({error})") from error
        check_identity(self.url, head)
        return identity_from(head, self._read_block(table.MACHINE_LIMITS, ends))

    def configure(self, configuration: Configuration, deadline_s: float) -> None:
        ends = self._clock.now() + deadline_s
        block, own = table.CONFIGURATION, self._session
        values = table.configuration_values(configuration, session=own.number, command=own.next_command())
        words = block.encode(values)
        self._write(block, words, ends)
        kept = self._call(
            ends, lambda c: c.read_holding_registers(block.address, count=block.count, device_id=table.UNIT)
        )
        wrong = table.differing(kept, words)
        if wrong:
            raise IdentityError(f"{self.url}: the rig did not keep its configuration: {', '.join(wrong)}")
        self._further_axes = configuration.further_axes

    def claim(self, deadline_s: float) -> int:
        ends = self._clock.now() + deadline_s
        nonce = table.CLAIM.encode({"nonce": self._nonce})
        self._write(table.CLAIM, nonce, ends)
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
                self._write(table.RELEASE, [own.number, own.next_command()], ends)
            except RequestDenied:
                if self._read_status(ends)[0].session == own.number:
                    raise
            self._session = Session()

    def command(self, control: Control, run_id: int, deadline_s: float) -> Status:
        return self._control(control, run_id, table.MODE_PROGRAM, 0.0, 0.0, deadline_s)

    def direct(self, displacement_m: float, current_a: float, deadline_s: float) -> Status:
        return self._control(Control.HOLD, 0, table.MODE_DIRECT, displacement_m, current_a, deadline_s)

    def jog(self, displacement_m: float, deadline_s: float) -> Status:
        return self._control(Control.HOLD, 0, table.MODE_JOG, displacement_m, 0.0, deadline_s)

    def _control(
        self,
        control: Control,
        run_id: int,
        mode: int,
        displacement_m: float,
        current_a: float,
        deadline_s: float,
    ) -> Status:
        ends = self._clock.now() + deadline_s
        number = self._session.next_command()
        words = table.CONTROL.encode(
            {
                "control": int(control),
                "session": self._session.number,
                "run_id": run_id,
                "command": number,
                "mode": mode,
                "reset_key": table.RESET_KEY if Control.RESET in control else 0,
                "direct_displacement_m": displacement_m,
                "direct_current_a": current_a,
            }
        )
        self._write(table.CONTROL, words, ends)
        while True:
            status, values = self._read_status(ends)
            if values["command_acknowledged"] == number:
                return status

    def stop(self, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        empty = dict.fromkeys((register.name for register in table.CONTROL.registers), 0)
        self._write(table.CONTROL, table.CONTROL.encode({**empty, "control": int(Control.DISABLE)}), ends)
        return self._read_status(ends)[0]

    def status(self, deadline_s: float) -> Status:
        ends = self._clock.now() + deadline_s
        if self._session.claimed:
            self._write(table.LEASE, [self._session.number, self._session.next_heartbeat()], ends)
        return self._read_status(ends)[0]

    def _write(self, block: table.Block, words: list[int], ends: float) -> None:
        self._call(ends, lambda c: c.write_registers(block.address, words, device_id=table.UNIT))

    def exchange(self, block: SetpointBlock | None, run_id: int, captured: int, deadline_s: float) -> Reply:
        ends = self._clock.now() + deadline_s
        own = self._session
        words = table.encode_write(block, run_id, captured, session=own.number, heartbeat=own.next_heartbeat())
        answer = self._call(
            ends,
            lambda c: c.readwrite_registers(
                read_address=table.READ_HEADER.address,
                read_count=table.READ_COUNT,
                write_address=table.WRITE_HEADER.address,
                values=words,
                device_id=table.UNIT,
            ),
        )
        opened = table.decode_read(answer)
        if opened is None:
            raise TransportError(f"{self.url}: an answer arrived damaged (CRC)")
        head, capture, refused = opened
        return Reply(
            state=RigState(int(head["state"])),
            faults=Fault(int(head["faults"])),
            last_accepted=int(head["last_accepted"]),
            fifo_free=int(head["fifo_free"]),
            consumed=int(head["consumed"]),
            refused=refused,
            heartbeat=int(head["samples"]) >> table.BEAT & HEARTBEATS - 1,
            owned=int(head["session"]) == own.number,
            capture=self._with_further(capture, ends) if self._further_axes else capture,
        )

    def _with_further(self, capture: CaptureBlock, ends: float) -> CaptureBlock:
        """The block with the channels of further axes: every exchange reads all windows, so each takes as long."""
        windows = [
            modbus_further.decode_further(k, self._read_input(header.address, modbus_further.COUNT, ends))
            for k, header in enumerate(modbus_further.HEADERS)
        ]
        whole = modbus_further.with_further(capture, windows)
        if whole is None:
            raise TransportError(f"{self.url}: the channels of further axes are not those of the captured samples")
        return whole

    def close(self) -> None:
        self._client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it without types

    def _read_block(self, block: table.Block, ends: float) -> dict[str, table.Value]:
        return block.decode(self._read_input(block.address, block.count, ends))

    def _read_input(self, address: int, count: int, ends: float) -> list[int]:
        return self._call(ends, lambda c: c.read_input_registers(address, count=count, device_id=table.UNIT))

    def _read_status(self, ends: float) -> tuple[Status, dict[str, table.Value]]:
        first = table.STATUS.address
        words = self._read_input(first, 0x60, ends)
        values: dict[str, table.Value] = {}
        for block in (table.STATUS, table.COUNTERS, table.ACTUALS):
            start = block.address - first
            values.update(block.decode(words[start : start + block.count]))
        return status_from(values), values

    def _call(self, ends: float, request: Callable[[ModbusTcpClient], ModbusPDU]) -> list[int]:
        """Make one transaction: the only place where errors of pymodbus become errors of this package."""
        remaining = ends - self._clock.now()
        if remaining <= 0:
            raise TransportTimeout(f"{self.url}: no time left before the deadline")
        self._client.comm_params.timeout_connect = remaining
        try:
            answer = request(self._client)
        except (ModbusException, OSError, ValueError) as error:
            self.close()
            late = self._clock.now() >= ends
            reason = " ".join(str(error).split())
            raise (TransportTimeout if late else TransportError)(f"{self.url}: {reason}") from error
        if answer.isError():
            code = int(getattr(answer, "exception_code", 0))
            raise RequestDenied(f"{self.url}: the rig refused: {ILLEGAL.get(code, f'exception {code}')}")
        return list(answer.registers)
