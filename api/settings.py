"""The settings of a service, from the environment and the command line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import isfinite
from pathlib import Path
from typing import Any

from api.errors import SettingsError

__all__ = ["Settings", "read_settings"]

PREFIX = "DAMPER_RIG_"
_READ_ELSEWHERE = (  # by the tests, by the command line, by identification.compute in the process of a job
    *("DAMPER_RIG_TEST_", "DAMPER_RIG_REQUIRE_ALL", "DAMPER_RIG_TRACEBACK"),
    *("DAMPER_RIG_EXECUTOR", "DAMPER_RIG_WORKERS"),
)
_DATABASES = ("sqlite:///", "postgresql+psycopg://")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """One service: where it listens, where it keeps campaigns, runs and results, and how long it waits."""

    data_dir: Path = Path("damper-rig-data")
    database_url: str = ""  # empty: an SQLite file in data_dir
    host: str = "127.0.0.1"
    port: int = 8420  # 0: any free port
    lease_s: float = 20.0  # a worker that does not renew its lease for this time may lose its rig or its job
    poll_s: float = 0.2  # interval at which campaigns, jobs, aborts and cancellations are looked for
    stop_s: float = 20.0  # longest time that a stopping service waits until its rigs are safe
    keep_results_days: float = 365.0  # until the files of a job's result are removed, from its end; its record stays

    def __post_init__(self) -> None:
        if not self.host.strip():
            raise SettingsError("host is empty: give a name or an address, for example 127.0.0.1")
        if not 0 <= self.port <= 65535:
            raise SettingsError(f"port is {self.port}: it must lie in 0 … 65535; 0: any free port")
        for name in ("lease_s", "poll_s", "stop_s"):
            seconds = getattr(self, name)
            if not (isfinite(seconds) and seconds > 0):
                raise SettingsError(f"{name} is {seconds}: it must be a positive number of seconds")
        if not self.keep_results_days > 0:
            raise SettingsError(
                f"keep_results_days is {self.keep_results_days}: it must be positive; inf: never removed"
            )
        if self.poll_s > self.lease_s / 4:
            raise SettingsError(
                f"poll_s is {self.poll_s:g}: it must not exceed a quarter of lease_s ({self.lease_s:g})"
            )
        if self.database_url and not self.database_url.startswith(_DATABASES):
            raise SettingsError(
                f"database_url begins {self.database_url.split(':')[0][:24]!r}: it must begin with "
                + " or ".join(_DATABASES)
            )

    @property
    def store_url(self) -> str:
        return self.database_url or f"sqlite:///{self.data_dir / 'damper-rig.db'}"

    @property
    def runs_dir(self) -> Path:
        return self.data_dir / "runs"

    @property
    def results_dir(self) -> Path:
        return self.data_dir / "reports"  # the name that it had when reports were the only results

    @property
    def keep_results_s(self) -> float:
        return self.keep_results_days * 86400.0


def read_settings(environ: Mapping[str, str], **given: Any) -> Settings:
    """The settings: the value ``given`` (not None), else the variable DAMPER_RIG_NAME, else the default.

    Any: an option of the command line has the type of its setting, which ``Settings`` checks.

    Raises SettingsError: one line, also for a variable DAMPER_RIG_… that is not known.
    """
    types = {field.name: type(field.default) for field in fields(Settings)}
    values: dict[str, Any] = {}
    for variable, text in environ.items():
        if not variable.startswith(PREFIX) or variable.startswith(_READ_ELSEWHERE):
            continue
        name = variable.removeprefix(PREFIX).lower()
        if name not in types:
            known = ", ".join(PREFIX + known.upper() for known in types)
            raise SettingsError(f"{variable} is not a known setting: known are {known}")
        values[name] = _converted(variable, text, types[name])
    return Settings(**(values | {name: value for name, value in given.items() if value is not None}))


def _converted(variable: str, text: str, kind: type) -> object:
    try:
        return kind(text)
    except ValueError as error:
        raise SettingsError(f"{variable} is {text!r}: it must be a number ({kind.__name__})") from error
