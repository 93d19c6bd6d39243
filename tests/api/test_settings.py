"""Settings come from what was given, then from the environment, then from the defaults, and are checked."""

from __future__ import annotations

from pathlib import Path

import pytest

from api.errors import SettingsError
from api.settings import Settings, read_settings


def test_what_is_given_stands_above_the_environment_and_that_above_the_default() -> None:
    environ = {"DAMPER_RIG_PORT": "9000", "DAMPER_RIG_HOST": "::1", "PATH": "/bin"}
    settings = read_settings(environ, port=9001, host=None)
    assert (settings.port, settings.host, settings.lease_s) == (9001, "::1", 20.0)


def test_the_store_lies_in_the_data_folder_unless_an_address_is_given() -> None:
    assert Settings(data_dir=Path("/lab")).store_url == "sqlite:////lab/damper-rig.db"
    url = "postgresql+psycopg://postgres@127.0.0.1/lab"
    assert Settings(database_url=url).store_url == url


@pytest.mark.parametrize(
    ("environ", "words"),
    [
        ({"DAMPER_RIG_PROT": "1"}, ["DAMPER_RIG_PROT", "DAMPER_RIG_PORT"]),
        ({"DAMPER_RIG_PORT": "many"}, ["DAMPER_RIG_PORT", "'many'", "number"]),
        ({"DAMPER_RIG_PORT": "-1"}, ["port", "-1", "65535"]),
        ({"DAMPER_RIG_LEASE_S": "nan"}, ["lease_s", "nan", "positive"]),
        ({"DAMPER_RIG_LEASE_S": "0.1"}, ["poll_s", "quarter"]),
        ({"DAMPER_RIG_KEEP_RESULTS_DAYS": "0"}, ["keep_results_days", "0", "inf"]),
        ({"DAMPER_RIG_KEEP_RESULTS_DAYS": "nan"}, ["keep_results_days", "nan", "positive"]),
        ({"DAMPER_RIG_HOST": " "}, ["host", "127.0.0.1"]),
        ({"DAMPER_RIG_DATABASE_URL": "oracle://x"}, ["oracle", "sqlite:///"]),
    ],
)
def test_a_setting_that_cannot_be_is_named_with_what_would_be_right(environ: dict[str, str], words: list[str]) -> None:
    with pytest.raises(SettingsError) as caught:
        read_settings(environ)
    assert all(word in str(caught.value) for word in words)
    assert "\n" not in str(caught.value)


def test_a_password_in_a_refused_address_is_not_repeated() -> None:
    with pytest.raises(SettingsError) as caught:
        Settings(database_url="mysql://someone:secret@host/x")
    assert "secret" not in str(caught.value)


def test_what_is_read_elsewhere_is_not_a_misspelt_setting() -> None:
    names = ("DAMPER_RIG_TEST_POSTGRESQL", "DAMPER_RIG_REQUIRE_ALL", "DAMPER_RIG_WORKERS", "DAMPER_RIG_EXECUTOR")
    assert read_settings(dict.fromkeys(names, "1")) == Settings()
