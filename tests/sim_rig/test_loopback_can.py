"""The CAN bus on this computer: what is sent arrives whole and in order, at one rig."""

from __future__ import annotations

import os
from collections.abc import Sequence

import can
import pytest

from rigctl.loopback_can import LoopbackBus


def test_the_loopback_keeps_a_burst_whole_and_in_order() -> None:
    name = f"burst-{os.getpid()}"
    rig = LoopbackBus(name, listen=True, fd=True)
    host = LoopbackBus(name, fd=True)
    assert rig.recv(0.05) is None
    sent: Sequence[can.Message] = [
        can.Message(
            arbitration_id=k % 0x7FF, data=bytes([k % 256] * (64 if k % 2 else 8)), is_extended_id=False, is_fd=True
        )
        for k in range(2000)
    ]
    host.send_all(sent[:1000])
    for message in sent[:1000]:
        got = rig.recv(1.0)
        assert got is not None
        assert (got.arbitration_id, got.data, got.is_fd) == (message.arbitration_id, message.data, True)
    rig.send(sent[1])
    assert host.recv(1.0) is not None
    host.shutdown()
    assert rig.recv(0.05) is None
    second = LoopbackBus(name, fd=True)
    second.send(sent[3])
    assert rig.recv(1.0) is not None
    rig.shutdown()
    with pytest.raises(can.CanOperationError):
        second.recv(1.0)
    for bus in (second, rig, rig):
        bus.shutdown()


def test_a_loopback_bus_has_one_rig() -> None:
    name = f"one-{os.getpid()}"
    rig = LoopbackBus(name, listen=True)
    with pytest.raises(can.CanInitializationError, match="another rig"):
        LoopbackBus(name, listen=True)
    rig.shutdown()
    with pytest.raises(can.CanInitializationError, match="no rig listens"):
        LoopbackBus(name)
    with pytest.raises(can.CanInitializationError, match="letters"):
        LoopbackBus("a/b")


def test_python_can_knows_the_loopback_as_an_interface_of_its_own() -> None:
    name = f"plug-in-{os.getpid()}"
    rig = LoopbackBus(name, listen=True)
    with can.Bus(interface="damper-rig-loopback", channel=name) as host:
        assert isinstance(host, LoopbackBus)
        host.send(can.Message(arbitration_id=5, data=b"abc", is_extended_id=False))
        got = rig.recv(1.0)
        assert got is not None
        assert bytes(got.data) == b"abc"
    rig.shutdown()
