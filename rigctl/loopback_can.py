"""A python-can interface for one machine without CAN: frames over a local stream socket, lossless and in order.

The rig listens on a name, the host connects to it; the socket buffers the frames of both, so none is lost in a burst.
"""

from __future__ import annotations

import getpass
import re
import select
import socket
import struct
import tempfile
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import can

_HEAD = struct.Struct("<IB")
_FD = 1 << 30
_EXTENDED = 1 << 31
_MOST_UNSENT_BYTES = 1 << 20  # bytes kept for a host that does not read; more are dropped


def socket_path(name: str) -> Path:
    """Name the socket of a loopback bus; the name may hold letters, digits, dot, dash and underscore."""
    if not re.fullmatch(r"[\w.-]{1,40}", name):
        raise can.CanInitializationError(f"loopback bus {name!r}: use 1 … 40 letters, digits, dots, dashes")
    return Path(tempfile.gettempdir()) / f"damper-rig-can-{getpass.getuser()}-{name}.sock"


class LoopbackBus(can.BusABC):
    """Both ends of a point-to-point bus; `listen` makes the rig's end, which takes one host after another."""

    def __init__(self, channel: str, *, listen: bool = False, fd: bool = False, **_: Any) -> None:
        self.channel_info = f"loopback {channel}"
        self._path, self._fd = socket_path(channel), fd
        self._buffer, self._unsent = bytearray(), bytearray()
        self._waiting: deque[can.Message] = deque()
        self._listener = _listen(self._path) if listen else None
        self._peer: socket.socket | None = None if listen else _connect(self._path)
        self._can_protocol = can.CanProtocol.CAN_FD if fd else can.CanProtocol.CAN_20
        super().__init__(channel)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.send_all([msg])

    def send_all(self, messages: Sequence[can.Message]) -> None:
        """Send frames together; without a host at the other end they are lost, as on an open bus.

        The rig's end never waits for the host; frames that the host does not read in time are lost.
        """
        data = b"".join(self._encode(message) for message in messages)
        if self._peer is None:
            return
        try:
            if self._listener is None:
                self._peer.sendall(data)
            else:
                self._send_or_buffer(data)
        except (BlockingIOError, TimeoutError) as error:
            raise can.CanOperationError("the other end does not read its frames") from error
        except OSError as error:
            self._handle_disconnect(error)

    def _send_or_buffer(self, data: bytes) -> None:
        """Send as much as the socket accepts and keep the rest, up to a limit."""
        assert self._peer is not None
        if len(self._unsent) < _MOST_UNSENT_BYTES:
            self._unsent += data
        with suppress(BlockingIOError):
            while self._unsent:
                del self._unsent[: self._peer.send(self._unsent, socket.MSG_DONTWAIT)]

    def _encode(self, message: can.Message) -> bytes:
        if message.is_fd and not self._fd:
            raise can.CanOperationError("an FD frame on a classic bus")
        flags = (_FD if message.is_fd else 0) | (_EXTENDED if message.is_extended_id else 0)
        return _HEAD.pack(message.arbitration_id | flags, len(message.data)) + bytes(message.data)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        ends = None if timeout is None else time.monotonic() + timeout
        while not self._waiting:
            left = None if ends is None else max(ends - time.monotonic(), 0.0)
            if not self._read(left):
                return None, True
        return self._waiting.popleft(), True

    def _read(self, timeout: float | None) -> bool:
        """Wait for bytes or for a host; False when the time is over."""
        source = self._peer or self._listener
        if source is None:
            raise can.CanOperationError("the bus is closed")
        if not select.select([source], [], [], timeout)[0]:
            return False
        if self._peer is None and self._listener is not None:
            self._peer = self._listener.accept()[0]
            self._peer.setblocking(False)
            return True
        try:
            data = source.recv(1 << 16)
        except OSError as error:
            self._handle_disconnect(error)
            return True
        if not data:
            self._handle_disconnect(ConnectionResetError("the other end has gone"))
        self._buffer += data
        self._decode()
        return True

    def _decode(self) -> None:
        at = 0
        while len(self._buffer) - at >= _HEAD.size:
            head, length = _HEAD.unpack_from(self._buffer, at)
            end = at + _HEAD.size + length
            if len(self._buffer) < end:
                break
            if self._can_read(head):
                self._waiting.append(
                    can.Message(
                        arbitration_id=head & 0x1FFFFFFF,
                        is_extended_id=bool(head & _EXTENDED),
                        is_fd=bool(head & _FD),
                        data=bytes(self._buffer[at + _HEAD.size : end]),
                        is_rx=True,
                    )
                )
            at = end
        del self._buffer[:at]

    def _can_read(self, head: int) -> bool:
        """Whether this end can read the frame; on a classic bus a rig ignores FD frames, a host raises."""
        if self._fd or not head & _FD:
            return True
        if self._listener is None:
            raise can.CanOperationError("an FD frame on a classic bus: add ?fd=true to the rig's address")
        return False

    def _handle_disconnect(self, error: OSError) -> None:
        """The rig's end waits for the next host; the host's end raises that the rig has gone."""
        if self._peer is not None:
            self._peer.close()
        self._peer = None
        self._buffer.clear()
        self._unsent.clear()
        if self._listener is None:
            raise can.CanOperationError(f"{self.channel_info}: {error}") from error

    def shutdown(self) -> None:
        if self._is_shutdown:
            return
        super().shutdown()
        for end in (self._peer, self._listener):
            if end is not None:
                end.close()
        if self._listener is not None:
            self._path.unlink(missing_ok=True)
        self._peer = self._listener = None


def _connect(path: Path) -> socket.socket:
    peer = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        peer.connect(str(path))
    except OSError as error:
        peer.close()
        raise can.CanInitializationError(f"no rig listens on this loopback bus ({error.strerror})") from error
    peer.settimeout(1.0)
    return peer


def _listen(path: Path) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        _connect(path).close()
    except can.CanInitializationError:
        path.unlink(missing_ok=True)  # left behind by a rig that was killed
    else:
        listener.close()
        raise can.CanInitializationError("another rig listens on this loopback bus")
    listener.bind(str(path))
    listener.listen(1)
    return listener
