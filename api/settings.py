"""The settings of a service, from the command line, the environment and a file."""

from __future__ import annotations

import json
import os
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from ipaddress import ip_network
from math import isfinite
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from api.errors import SettingsError, one_line

__all__ = [
    "LEAST_CONNECTIONS",
    "LEAST_FREE_BYTES",
    "MOST_UPLOAD_BYTES_TOTAL",
    "Settings",
    "as_environment",
    "as_toml",
    "read_settings",
]

PREFIX = "DAMPER_RIG_"
# Ten minutes of 12 channels at 5 kHz, 0.29 GB, that run while an upload is accepted; 0.5 GB for results and the log of
# the database until somebody looks. Half of it: a long test may fill the disk; double: less is usable.
LEAST_FREE_BYTES = 1 << 30
LEAST_CONNECTIONS = 100  # of which a part is kept for stops and short requests
MOST_UPLOAD_BYTES_TOTAL = 50 << 30  # a tenth of a disk of 500 GB
_READ_ELSEWHERE = (  # by the tests, by the command line, by identification.compute in the process of a job
    *("DAMPER_RIG_TEST_", "DAMPER_RIG_REQUIRE_ALL", "DAMPER_RIG_TRACEBACK"),
    *("DAMPER_RIG_EXECUTOR", "DAMPER_RIG_WORKERS"),
    *("DAMPER_RIG_CONFIG", "DAMPER_RIG_SERVICE", "DAMPER_RIG_KEY"),  # the file of settings; what a client uses
)
_TRUTHS = {"true": True, "1": True, "false": False, "0": False}
_WORDS = {int: "a whole number", float: "a number", bool: "true or false"}
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
    rigs_allowed: str = (
        "modbus://127.0.0.1:*,can://loopback/*"  # addresses that a rig may have; * and ? as in file names
    )
    envelopes: str = ""  # files of what every rig and specimen can do, separated as in PATH
    keep_results_days: float = 365.0  # until the files of a job's result are removed, from its end; its record stays
    least_free_bytes: int = LEAST_FREE_BYTES  # on the disk of data_dir; below, no test begins and no upload is kept
    most_upload_bytes_total: int = MOST_UPLOAD_BYTES_TOTAL  # of all uploaded runs and samples
    job_memory_bytes: int = 0  # that a process of a job may take (Linux); 0: half of the computer's memory
    log_format: str = "text"  # text, or json: one JSON object a line
    access: str = "open"  # open: on loopback, until the first key is made; keys: always
    allowed_hosts: str = ""  # names under which it is asked for, beside loopback and host, separated by commas
    trusted_proxies: str = ""  # addresses or networks whose X-Forwarded-… headers are true, separated by commas
    tls_certificate: str = ""  # file, PEM
    tls_key: str = ""  # file, PEM
    insecure_network: bool = False  # True: keys and data may pass the network unencrypted
    connections: int = 1000  # at once; fewer where the process may not open 200 files more, and at least 100
    connections_per_address: int = 200  # at once, of one address that is neither loopback nor a trusted proxy
    header_s: float = 10.0  # longest time in which the headers of a request must come
    requests_per_s: float = 500.0  # of one key; twice as many at once

    runs_quota_gb: float = float("inf")  # of all run files; at it no test starts and nothing is uploaded
    keep_keys_hours: float = 24.0  # for which a repeated request with its Idempotency-Key has the answer of the first

    def __post_init__(self) -> None:
        if not self.host.strip():
            raise SettingsError("host is empty: give a name or an address, for example 127.0.0.1")
        if not 0 <= self.port <= 65535:
            raise SettingsError(f"port is {self.port}: it must lie in 0 … 65535; 0: any free port")
        for name in ("lease_s", "poll_s", "stop_s", "header_s"):
            seconds = getattr(self, name)
            if not (isfinite(seconds) and seconds > 0):
                raise SettingsError(f"{name} is {seconds}: it must be a positive number of seconds")
        for name in ("least_free_bytes", "most_upload_bytes_total", "job_memory_bytes"):
            if getattr(self, name) < 0:
                raise SettingsError(f"{name} is {getattr(self, name)}: it must be 0 or more bytes")
        if self.log_format not in ("text", "json"):
            raise SettingsError(f"log_format is {self.log_format!r:.40}: it must be text or json")
        if not self.rig_patterns:
            raise SettingsError("rigs_allowed is empty: give patterns of addresses, for example modbus://10.0.7.*:502")
        if not self.keep_results_days > 0:
            raise SettingsError(
                f"keep_results_days is {self.keep_results_days}: it must be positive; inf: never removed"
            )
        if not self.runs_quota_gb > 0:
            raise SettingsError(f"runs_quota_gb is {self.runs_quota_gb}: it must be positive; inf: no quota")
        if not 0 < self.keep_keys_hours < float("inf"):
            raise SettingsError(f"keep_keys_hours is {self.keep_keys_hours}: it must be a positive number of hours")
        if self.poll_s > self.lease_s / 4:
            raise SettingsError(
                f"poll_s is {self.poll_s:g}: it must not exceed a quarter of lease_s ({self.lease_s:g})"
            )
        if self.database_url and not self.database_url.startswith(_DATABASES):
            raise SettingsError(
                f"database_url begins {self.database_url.split(':')[0][:24]!r}: it must begin with "
                + " or ".join(_DATABASES)
            )
        self._check_network()

    def _check_network(self) -> None:
        if self.access not in ("open", "keys"):
            raise SettingsError(f"access is {self.access!r:.40}: it must be open or keys")
        if bool(self.tls_certificate) != bool(self.tls_key):
            raise SettingsError("tls_certificate and tls_key belong together: give both, or none")
        if self.connections < LEAST_CONNECTIONS or self.connections_per_address < 1:
            raise SettingsError(
                f"connections is {self.connections}, connections_per_address {self.connections_per_address}: "
                f"they must be at least {LEAST_CONNECTIONS} and 1"
            )
        if not self.requests_per_s >= 1:
            raise SettingsError(f"requests_per_s is {self.requests_per_s}: it must be at least 1; inf: no limit")
        for host in filter(None, map(str.strip, self.allowed_hosts.split(","))):
            if not all(sign.isalnum() or sign in "-.:" for sign in host):
                raise SettingsError(f"allowed_hosts contains {host!r:.60}: give names or addresses without port or *")
        for proxy in filter(None, map(str.strip, self.trusted_proxies.split(","))):
            try:
                ip_network(proxy)
            except ValueError as error:
                raise SettingsError(
                    f"trusted_proxies contains {proxy!r:.60}: give addresses or networks as 10.0.0.7 or 10.0.0.0/24"
                ) from error

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
    def lines_dir(self) -> Path:
        return self.data_dir / "workers"  # how the service reaches the worker of each rig, for this user alone

    @property
    def rig_patterns(self) -> tuple[str, ...]:
        return tuple(pattern for text in self.rigs_allowed.split(",") if (pattern := text.strip()))

    @property
    def keep_results_s(self) -> float:
        return self.keep_results_days * 86400.0


def read_settings(environ: Mapping[str, str], config: Path | None = None, **given: Any) -> Settings:
    """The settings: the value ``given`` (not None), else the variable DAMPER_RIG_NAME, else the file, else the default.

    The file is ``config``, else the one that DAMPER_RIG_CONFIG names. Any: an option of the command line has the type
    of its setting, which ``Settings`` checks.

    Raises SettingsError: one line, also for a variable DAMPER_RIG_… or a key of the file that is not known.
    """
    file = config or (Path(environ["DAMPER_RIG_CONFIG"]) if environ.get("DAMPER_RIG_CONFIG") else None)
    chosen = {name: value for name, value in given.items() if value is not None}
    if _has_password(str(chosen.get("database_url", ""))):
        raise SettingsError(
            "--database has a password, which every user of this computer can see in the list of processes: "
            "give the URL as DAMPER_RIG_DATABASE_URL or in the file of settings"
        )
    return Settings(**(({} if file is None else _from_file(file)) | _from_environment(environ) | chosen))


def as_environment(settings: Settings) -> dict[str, str]:
    """The settings as variables of the environment, for another process of this program; passwords included."""
    values = {field.name: getattr(settings, field.name) for field in fields(Settings)}
    texts = {name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in values.items()}
    return {PREFIX + name.upper(): text for name, text in texts.items()}


def as_toml(settings: Settings) -> str:
    """The settings as a file of settings, one key a line; a password is shown as ***."""
    lines = []
    for field in fields(Settings):
        value = getattr(settings, field.name)
        if isinstance(value, (str, Path)):
            value = json.dumps(_without_password(str(value)), ensure_ascii=False)
        lines.append(f"{field.name} = {str(value).lower() if isinstance(value, bool) else value}\n")
    return "".join(lines)


def _from_environment(environ: Mapping[str, str]) -> dict[str, Any]:
    types = _types()
    values: dict[str, Any] = {}
    for variable, text in environ.items():
        if not variable.startswith(PREFIX) or variable.startswith(_READ_ELSEWHERE):
            continue
        name = variable.removeprefix(PREFIX).lower()
        if name not in types:
            known = ", ".join(PREFIX + known.upper() for known in types)
            raise SettingsError(f"{variable} is not a known setting: known are {known}")
        values[name] = _converted(variable, text, types[name])
    return values


def _from_file(file: Path) -> dict[str, Any]:
    try:
        keys = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SettingsError(f"{file}: cannot be read as TOML: {one_line(error)}") from error
    types = _types()
    for name in keys:
        if name not in types:
            raise SettingsError(f"{file}: {name} is not a known setting: known are {', '.join(types)}")
    if _has_password(str(keys.get("database_url", ""))) and file.stat().st_mode & stat.S_IROTH:
        raise SettingsError(f"{file}: has a password and every user can read it: chmod o-r {file}")
    return {name: _typed(f"{file}: {name}", value, types[name]) for name, value in keys.items()}


def _types() -> dict[str, type]:
    return {field.name: type(field.default) for field in fields(Settings)}


def _typed(where: str, value: object, kind: type) -> object:
    """A value of TOML as the type of its setting; lists of files are joined as in PATH, others with commas."""
    if isinstance(value, list) and kind is str and all(isinstance(part, str) for part in value):
        return (os.pathsep if where.endswith(": envelopes") else ",").join(value)
    if issubclass(kind, Path) and isinstance(value, str):
        return kind(value)
    if kind is float and type(value) is int:
        return float(value)
    if type(value) is kind:
        return value
    raise SettingsError(f"{where} is {value!r:.60}: it must be {_WORDS.get(kind, 'a text')}")


def _converted(variable: str, text: str, kind: type) -> object:
    if kind is bool:
        if text.lower() not in _TRUTHS:
            raise SettingsError(f"{variable} is {text!r}: it must be true or false")
        return _TRUTHS[text.lower()]
    try:
        return kind(text)
    except ValueError as error:
        raise SettingsError(f"{variable} is {text!r}: it must be a number ({kind.__name__})") from error


def _without_password(url: str) -> str:
    if not _has_password(url):
        return url
    parts = urlsplit(url)
    return parts._replace(netloc=f"{parts.username or ''}:***@{parts.netloc.rpartition('@')[2]}").geturl()


def _has_password(url: str) -> bool:
    try:
        return bool(urlsplit(url).password)
    except ValueError:
        return False
