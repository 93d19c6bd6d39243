"""An address is checked as it is used, without a transport."""

from __future__ import annotations

from contextlib import closing

import pytest

from rigctl.address import check_address, connect
from rigctl.errors import UrlError

GOOD = ("modbus://127.0.0.1:5020", "modbus://[2001:db8::7]:502", "can://loopback/a", "can://virtual/b?fd=true")
WRONG = (
    *("modbus://127.0.0.1", "modbus://:5020", "modbus://host:x", "modbus://host:502/x", "modbus://a@host:502"),
    *("can://loopback", "can://nothing/a", "can://virtual/a?z=1", "can://virtual/a?bitrate=0", "can://virtual/a?fd=1"),
    *(f"can://loopback/{'a' * 300}", "http://host", "host:502", ""),
)


@pytest.mark.parametrize("url", GOOD)
def test_what_can_be_connected_passes(url: str) -> None:
    check_address(url)
    with closing(connect(url)) as transport:
        assert transport.session == 0  # nothing was sent


@pytest.mark.parametrize("url", WRONG)
def test_what_cannot_is_refused_with_the_same_words(url: str) -> None:
    with pytest.raises(UrlError) as refused:
        connect(url)
    with pytest.raises(UrlError) as checked:
        check_address(url)
    assert str(checked.value) == str(refused.value)
