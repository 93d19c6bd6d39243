"""What ``run`` is told about specimen, fixture, oil, calibration and tare: checked before anything moves."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rigctl.preparation import Mass, Tare
    from rigctl.procedures.operator import Operator
    from rigctl.setup import Setup
    from rigctl.transport import Transport

    Record = TypeVar("Record", Tare, Mass)

__all__ = ["read_record", "setup_from", "write_record"]


def setup_from(
    operator: Operator,
    transport: Transport,
    *,
    serial: str,
    fixture: str,
    oil: str,
    calibration: Path | None,
    tare: Path | None,
) -> Setup:
    """The setup of the runs. An expired calibration is asked for, a tare of another rig or of yesterday refused.

    Raises CalibrationError, ProcedureError or InputError: one line.
    """
    from rigctl.axis import Axis
    from rigctl.calibration import check_valid, read_calibrations
    from rigctl.clock import SystemClock
    from rigctl.errors import CalibrationExpired, Declined
    from rigctl.preparation import Tare
    from rigctl.procedures.tare import check_tare
    from rigctl.setup import Setup

    calibrations = () if calibration is None else read_calibrations(calibration)
    notes: tuple[str, ...] = ()
    try:
        check_valid(calibrations, datetime.now(UTC).date())
    except CalibrationExpired as expired:
        try:
            operator.confirm(f"{expired}. Go on with it?")
        except Declined:
            raise expired from None
        notes = (f"the operator accepted: {expired}",)
    stored = None if tare is None else read_record(tare, Tare)
    if stored is not None:
        check_tare(stored, Axis(transport, SystemClock(), stall_s=5.0).identify(), datetime.now(UTC))
    return Setup(specimen_serial=serial, fixture=fixture, oil=oil, calibrations=calibrations, tare=stored, notes=notes)


def read_record(path: Path, kind: type[Record]) -> Record:
    """Read a record that a procedure has written; ProcedureError or InputError, one line, otherwise."""
    from api.cli.terminal import existing
    from api.errors import InputError
    from excitation.untrusted import parse_json
    from rigctl.preparation import record_from

    try:
        content = parse_json(existing(path, "the record of a procedure").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not the record of a procedure ({' '.join(str(error).split())[:80]})") from error
    return record_from(kind, content, str(path))


def write_record(path: Path, content: object) -> None:
    """Write a result as JSON, whole or not at all."""
    from api.errors import InputError
    from excitation.atomic import written_whole

    with written_whole(path, InputError) as temporary:
        temporary.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
