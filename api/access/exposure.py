"""Whether a service may listen where it was told to: from the network only with keys, and only encrypted."""

from __future__ import annotations

from pathlib import Path

from api.access.hosts import LOOPBACK_NAMES, is_loopback
from api.errors import SettingsError
from api.settings import Settings

__all__ = ["allowed_hosts", "check_exposure", "network_list"]

_MAKE_ONE = "make one on this machine: damper-rig key create NAME --scope admin"


def network_list(text: str) -> list[str]:
    """The entries of a setting that is a list, separated by commas."""
    return [entry.strip() for entry in text.split(",") if entry.strip()]


def allowed_hosts(settings: Settings) -> list[str]:
    """The names under which the service may be asked for."""
    return [*LOOPBACK_NAMES, settings.host.lower(), *network_list(settings.allowed_hosts)]


def check_exposure(settings: Settings, *, keys_made: bool) -> None:
    """Raises SettingsError, in one line that says what to do, where the service must not start."""
    for setting in ("tls_certificate", "tls_key"):
        path = getattr(settings, setting)
        if path and not Path(path).is_file():
            raise SettingsError(f"{setting} is {path!r}: there is no such file")
    if settings.access == "keys" and not keys_made:
        raise SettingsError(f"access is keys, and there is no key: {_MAKE_ONE}")
    if network_list(settings.trusted_proxies) and not keys_made:
        raise SettingsError(f"trusted_proxies lets others connect, and there is no key: {_MAKE_ONE}")
    if is_loopback(settings.host):
        return
    here = f"host is {settings.host!r}, so others can connect"
    if not keys_made:
        raise SettingsError(f"{here}, and there is no key: {_MAKE_ONE}")
    if not (settings.tls_certificate or network_list(settings.trusted_proxies) or settings.insecure_network):
        raise SettingsError(
            f"{here}, and keys would be readable on the way: set tls_certificate and tls_key, or name the proxy that "
            "encrypts in trusted_proxies, or accept it with insecure_network = true"
        )
