"""One rig has one address, however it is spelt."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigctl.canonical import canonical_address, is_allowed
from rigctl.errors import UrlError

HERE = "modbus://127.0.0.1:5020"


@pytest.mark.parametrize(
    "spelling",
    [
        *(
            "modbus://localhost:5020",
            "MODBUS://LocalHost:5020",
            "modbus://localhost.:5020",
            " modbus://127.0.0.1:5020/",
        ),
        *("modbus://[::1]:5020", "modbus://[0:0:0:0:0:0:0:1]:5020", "modbus://[::ffff:127.0.0.1]:5020"),
        *("modbus://127.1:5020", "modbus://0x7f.1:5020", "modbus://2130706433:5020", "modbus://127.0.0.1:05020"),
    ],
)
def test_every_spelling_of_this_computer_is_one_address(spelling: str) -> None:
    assert canonical_address(spelling) == HERE


def test_defaults_are_written_out_or_left_out_and_options_are_sorted() -> None:
    assert canonical_address("modbus://Rig-7.Lab") == "modbus://rig-7.lab:502"
    assert canonical_address("modbus://[2001:DB8:0::7]:502") == "modbus://[2001:db8::7]:502"
    assert canonical_address("CAN://LOOPBACK/a?fd=false&bitrate=1000000") == "can://loopback/a"
    options = "data_bitrate=4000000&fd=true"
    assert canonical_address("can://socketcan/can0?fd=true&data_bitrate=4000000") == f"can://socketcan/can0?{options}"


@pytest.mark.parametrize(
    "wrong",
    [
        *(
            "5020",
            "http://rig",
            "modbus://",
            "modbus://:5020",
            "modbus://host:99999",
            "modbus://host:0",
            "modbus://h:x",
        ),
        *("modbus://0.0.0.0:502", "modbus://[::]:502", "modbus://a@host:502", "modbus://host:502/x", "modbus://a b:1"),
        *("modbus://256.1.1.1.1:502", "modbus://1.2.3.999:502", "modbus://-a:502", "can://loopback", "can://x/y?z=1"),
    ],
)
def test_what_is_no_address_is_refused_in_one_line_that_names_it(wrong: str) -> None:
    with pytest.raises(UrlError) as refused:
        canonical_address(wrong)
    assert wrong in str(refused.value)
    assert "\n" not in str(refused.value)


@settings(max_examples=50)
@given(st.text(max_size=40))
def test_the_one_spelling_of_the_one_spelling_is_itself(rest: str) -> None:
    for scheme in ("modbus://", "can://"):
        try:
            once = canonical_address(scheme + rest)
        except UrlError:
            continue
        assert canonical_address(once) == once


def test_only_what_a_pattern_names_is_allowed() -> None:
    patterns = ("modbus://127.0.0.1:*", "can://loopback/*")
    for allowed in (HERE, "can://loopback/a?fd=true"):
        assert is_allowed(allowed, patterns)
    for other in ("modbus://10.0.0.1:502", "modbus://127.0.0.1.evil.example:502", "can://socketcan/can0"):
        assert not is_allowed(canonical_address(other), patterns)
