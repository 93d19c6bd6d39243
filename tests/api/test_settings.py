"""Settings come from what was given, then from the environment, then from the defaults, and are checked."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from api.errors import SettingsError
from api.settings import Settings, as_toml, read_settings


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


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "damper-rig.toml"
    made.write_text(
        'data_dir = "/lab"\nport = 9000\nlease_s = 30\nhost = "::1"\nenvelopes = ["/a.toml", "/b.toml"]\n',
        encoding="utf-8",
    )
    return made


def test_the_file_stands_below_the_environment_and_above_the_default(file: Path) -> None:
    environ = {"DAMPER_RIG_CONFIG": str(file), "DAMPER_RIG_HOST": "127.0.0.2", "DAMPER_RIG_PORT": "9001"}
    settings = read_settings(environ, port=9002)
    assert (settings.port, settings.host, settings.data_dir) == (9002, "127.0.0.2", Path("/lab"))
    assert (settings.lease_s, settings.poll_s) == (30.0, 0.2)
    assert settings.envelopes == os.pathsep.join(("/a.toml", "/b.toml"))
    assert read_settings({}, file) == read_settings({"DAMPER_RIG_CONFIG": str(file)})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("prot = 1", ["prot", "not a known setting", "port"]),
        ('port = "many"', ["port", "'many'", "whole number"]),
        ("port = true", ["port", "True", "whole number"]),
        ("host = 7", ["host", "7", "text"]),
        ("port = -1", ["port", "-1", "65535"]),
        ("port = ", ["cannot be read as TOML"]),
        ("[service]\nport = 1", ["service", "not a known setting"]),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(file: Path, text: str, words: list[str]) -> None:
    file.write_text(text)
    with pytest.raises(SettingsError) as caught:
        read_settings({}, file)
    assert all(word in str(caught.value) for word in words)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"nothing\.toml: cannot be read"):
        read_settings({}, tmp_path / "nothing.toml")


PASSWORD = "postgresql+psycopg://someone:secret@127.0.0.1/lab"


def test_a_password_is_given_in_the_environment_or_in_a_file_of_the_owner_only(file: Path) -> None:
    assert read_settings({"DAMPER_RIG_DATABASE_URL": PASSWORD}).database_url == PASSWORD
    file.write_text(f'database_url = "{PASSWORD}"')
    file.chmod(0o640)
    assert read_settings({}, file).database_url == PASSWORD
    file.chmod(0o644)
    for refused in (lambda: read_settings({}, file), lambda: read_settings({}, database_url=PASSWORD)):
        with pytest.raises(SettingsError) as caught:
            refused()
        assert "secret" not in str(caught.value)


def test_printed_settings_are_a_file_that_gives_the_same_settings(tmp_path: Path, file: Path) -> None:
    settings = read_settings({"DAMPER_RIG_KEEP_RESULTS_DAYS": "inf", "DAMPER_RIG_DATA_DIR": 'a "b" ü\\'}, file)
    printed = tmp_path / "printed.toml"
    printed.write_text(as_toml(settings), encoding="utf-8")
    assert read_settings({}, printed) == settings


def test_printed_settings_show_no_password() -> None:
    text = as_toml(Settings(database_url=PASSWORD))
    assert "postgresql+psycopg://someone:***@127.0.0.1/lab" in text
    assert "secret" not in text
