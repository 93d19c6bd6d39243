"""A map of a foreign controller is checked whole before anything is sent; one line says what would be right."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.campaigns.new_campaign import NewCampaign
from api.errors import InputError
from rigctl.address import connect
from rigctl.device import Fault
from rigctl.errors import MapError
from rigctl.machines.registers import Order, Orders, Register, RegisterType, decode, encode
from rigctl.machines.rig_map import read_rig_map
from rigctl.machines.roles import Role

EXAMPLES = Path(__file__).parents[2] / "examples" / "rigs"
PLC = (EXAMPLES / "plc_streamed.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_example_is_a_valid_map(path: Path) -> None:
    assert read_rig_map(path).simulated


@pytest.mark.parametrize(
    ("was", "becomes", "says"),
    [
        ('way = "streamed"', 'way = "buffered"', "role buffer_free is missing: way buffered needs"),
        ('way = "streamed"', 'way = "teleported"', "way is 'teleported': it must be 'streamed', 'buffered'"),
        ('way = "streamed"', 'way = "file"', "way is file: over modbus it must be streamed or buffered or generator"),
        ("port = 5021", "port = 70000", "modbus: port is 70000: it must lie in 1 … 65535"),
        ("unit = 7", "unit = 300", "modbus: unit is 300: it must lie in 0 … 247"),
        ('word_order = "low_first"', 'word_order = "middle"', "modbus.word_order is 'middle': it must be"),
        ("rate = 100.0", "rate = 0.0", "clock: rate is 0.0 Hz: it must lie in 1 … 20 000"),
        ("rate = 100.0", "raet = 100.0", "clock.raet = 100.0 is not a known key: known are rate"),
        ("time = 0.5\n", "time = 60.0\n", "watchdog: time is 60.0 s: it must lie in 0.1 … 10"),
        ("position_min = -0.07", "position_min = 0.01", "limits: position limits 0.01 … 0.07 m: 0 must lie between"),
        ('1 = "emergency_stop"', '1 = "wind"', "faults.1 is 'wind': it must be"),
        ('1 = "emergency_stop"', 'one = "pressure"', "faults.one: it must be the controller's code"),
        ('address = 4098\ntype = "real"', 'address = 4097\ntype = "real"', "address 4097 belongs to"),
        ('role = "setpoint"', 'role = "setpiont"', ".role is 'setpiont': it must be"),
        ("address = 4098", "address = 65535", "register setpoint at 65535: it must lie in 0 … 65535 with all"),
        ('role = "setpoint"\naddress = 4098', 'role = "setpoint"\naddress = 4098\nfunction = 4', "can only be read"),
        ("scale = 0.001", "scale = 0.0", "scale is 0.0"),
        ("bit = 0", "bit = 16", "bit is 16: say which of 0 … 15"),
        ('role = "host_counter"', 'role = "limit_force"', "role host_counter is missing: the controller must notice"),
        ('role = "tick"', 'role = "position"', "role position is given 2 times"),
        ("simulated = true", "simulated = 1", "simulated is 1: it must be a valid boolean"),
        ("[modbus]", "[canopn]", "canopn = {"),
    ],
)
def test_a_wrong_map_is_refused_in_one_line(was: str, becomes: str, says: str, tmp_path: Path) -> None:
    text = PLC.replace("1e-3", "0.001")
    assert was in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(was, becomes, 1), encoding="utf-8")
    with pytest.raises(MapError) as caught:
        read_rig_map(path)
    message = str(caught.value)
    assert says in message
    assert message.startswith(str(path))
    assert "\n" not in message


def test_the_watchdog_of_a_controller_must_be_stated(tmp_path: Path) -> None:
    before, _, after = PLC.partition("[watchdog]")
    path = tmp_path / "rig.toml"
    path.write_text(before + after[after.index("[limits]") :], encoding="utf-8")
    with pytest.raises(MapError, match="watchdog is missing: add it"):
        read_rig_map(path)


def test_the_path_of_a_map_is_an_address() -> None:
    with pytest.raises(MapError, match=r"nowhere\.toml"):
        connect("nowhere.toml")


def test_the_service_takes_no_map_because_a_client_must_not_choose_files() -> None:
    sine = {"name": "s", "kind": "sine", "sample_rate": 100.0, "amplitude": 0.01, "frequency": 1.0, "cycles": 2}
    with pytest.raises(InputError, match="for the command line, give an address"):
        NewCampaign(name="n", specimen="s", rig="/etc/rig.toml", tests=(sine,))


def test_a_code_that_the_map_does_not_name_is_a_fault_all_the_same() -> None:
    rig = read_rig_map(EXAMPLES / "plc_streamed.toml")
    assert rig.fault_of(21) is Fault.HEARTBEAT
    assert rig.fault_of(4711) is Fault.FOREIGN


ORDERS = st.sampled_from(["high_first", "low_first"])
RANGES = {"u16": (0, 0xFFFF), "i16": (-0x8000, 0x7FFF), "u32": (0, 0xFFFFFFFF), "i32": (-0x80000000, 0x7FFFFFFF)}


@given(kind=st.sampled_from(sorted(RANGES)), share=st.floats(0, 1), word=ORDERS, byte=ORDERS)
def test_an_integer_comes_back_whatever_the_order_of_words_and_bytes(
    kind: str, share: float, word: str, byte: str
) -> None:
    low, high = RANGES[kind]
    value = float(round(low + share * (high - low)))
    register = Register(role=Role.TARGET, address=0, type=cast(RegisterType, kind))
    orders = Orders(cast(Order, word), cast(Order, byte))
    assert decode(register, encode(register, value, orders), orders) == value


def test_word_and_byte_order_are_those_that_the_manuals_name() -> None:
    """1234.5 as REAL is 449A5000: ABCD, CDAB, BADC, DCBA."""
    register = Register(role=Role.TARGET, address=0, type="real")
    written = {
        (word, byte): encode(register, 1234.5, Orders(word, byte))
        for word in ("high_first", "low_first")
        for byte in ("high_first", "low_first")
    }
    assert written == {
        ("high_first", "high_first"): [0x449A, 0x5000],
        ("low_first", "high_first"): [0x5000, 0x449A],
        ("high_first", "low_first"): [0x9A44, 0x0050],
        ("low_first", "low_first"): [0x0050, 0x9A44],
    }


def test_a_value_that_does_not_fit_its_register_is_refused() -> None:
    register = Register(role=Role.TARGET, address=40, type="i16", scale=1e-6)
    with pytest.raises(MapError, match=r"register target at 40: 1 does not fit i16"):
        encode(register, 1.0, Orders("high_first", "high_first"))
