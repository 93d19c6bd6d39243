"""A certificate of this computer, for the time of a test."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from tests.conftest import missing


def a_certificate(folder: Path) -> tuple[Path, Path]:
    """The certificate and its key, in PEM files."""
    if shutil.which("openssl") is None:
        missing("no openssl: put it on the PATH")
    certificate, secret = folder / "cert.pem", folder / "key.pem"
    subprocess.run(
        [
            *("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"),
            *("-keyout", str(secret), "-out", str(certificate), "-days", "2", "-subj", "/CN=localhost"),
            *("-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"),
        ],
        check=True,
        capture_output=True,
    )
    return certificate, secret
