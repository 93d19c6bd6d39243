"""``damper-rig rig …``: what a laboratory does before a test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli.options import Url, Yes
from api.cli.places import to_file, to_folder

if TYPE_CHECKING:
    from excitation import Test
    from rigctl.preparation import Tare
    from rigctl.procedures.operator import Operator
    from rigctl.runfile import Run
    from rigctl.transport import Transport

__all__ = ["add_to"]

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Record = Annotated[
    Path | None, typer.Option("-o", "--output", callback=to_file, help="Write the record to this file (.json).")
]
TareFile = Annotated[Path | None, typer.Option("--tare", help="Tare of the load cell, from 'damper-rig rig tare'.")]
Limit = Annotated[float | None, typer.Option(help="Force at which a movement stops, N; default: 5 % of the rig's.")]


def add_to(group: typer.Typer) -> None:
    """Add the commands of this file to the group of rig commands."""
    for command in (calibration, tare, mount, remove, jog, crawl, weigh, compensate):
        group.command()(command)


def calibration(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Calibration records (.toml, .json).")],
    as_json: Json = False,
) -> None:
    """Check calibration records: one line for each sensor. Exit status 1: one has expired.

    Example: damper-rig rig calibration sensors.toml
    """
    from datetime import UTC, datetime

    from api.cli.terminal import answer
    from rigctl.calibration import read_calibrations

    today = datetime.now(UTC).date()
    records = read_calibrations(file)
    lines = [f"{one}: {'expired on' if one.expired(today) else 'valid to'} {one.expires}" for one in records]
    answer("\n".join(lines), [{**asdict(one), "expired": one.expired(today)} for one in records], as_json=as_json)
    if any(one.expired(today) for one in records):
        raise typer.Exit(1)


def tare(
    url: Url,
    output: Record = None,
    limit: Annotated[float | None, typer.Option(help="Largest tare, N; default: 4 % of the rig's force limit.")] = None,
    readings: Annotated[int, typer.Option(help="Readings, about 100 a second.")] = 200,
    as_json: Json = False,
) -> None:
    """Read the load cell without load: its mean, with uncertainty, for 'damper-rig run --tare'. Nothing moves.

    Refused where the piston moves, the force is not steady, or its mean is beyond the limit.

    Example: damper-rig rig tare modbus://127.0.0.1:5020 -o tare.json
    """
    from contextlib import closing

    from rigctl.clock import SystemClock
    from rigctl.player import connect
    from rigctl.procedures.station import commanded
    from rigctl.procedures.tare import TareSettings
    from rigctl.procedures.tare import tare as tare_of

    settings = TareSettings(readings=readings, limit_n=limit)
    with closing(connect(url)) as transport, commanded(transport, SystemClock()) as station:
        found = tare_of(station.axis, station.clock, station.identity, settings)
    _tell(str(found), asdict(found), output, as_json=as_json)


def mount(
    url: Url,
    output: Record = None,
    at: Annotated[float, typer.Option(help="Displacement at which the specimen is attached, m.")] = 0.0,
    reach: Annotated[float, typer.Option(help="Largest movement of the force-controlled zero, m.")] = 0.02,
    limit: Limit = None,
    tare: Annotated[bool, typer.Option("--tare/--no-tare", help="Tare before the specimen is attached.")] = True,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Mount a specimen: tare, travel slowly to its place, attach it without power, find the zero of its force.

    The protocol of the rig has no command for low pressure: you are asked to set it by hand. Every movement is limited
    to 10 mm/s, by the rig as well.

    Example: damper-rig rig mount modbus://127.0.0.1:5020 -o mounted.json
    """
    from contextlib import closing

    from rigctl.clock import SystemClock
    from rigctl.player import connect
    from rigctl.procedures.mounting import MountingSettings
    from rigctl.procedures.mounting import mount as mounted_by
    from rigctl.procedures.tare import TareSettings

    settings = MountingSettings(at_m=at, reach_m=reach, limit_n=limit, tare=TareSettings() if tare else None)
    with closing(connect(url)) as transport:
        found = mounted_by(transport, SystemClock(), _operator(transport, "Mounting of a specimen", yes=yes), settings)
    here = found.zero
    text = f"mounted: {here.force_n:.1f} N ± {2 * here.uncertainty_n:.1f} N at {1e3 * here.displacement_m:.2f} mm"
    content = {"zero": asdict(here), "tare": None if found.tare is None else asdict(found.tare)}
    _tell(text if found.tare is None else f"{found.tare}\n{text}", content, output, as_json=as_json)


def remove(
    url: Url,
    tare: TareFile = None,
    reach: Annotated[float, typer.Option(help="Largest movement of the force-controlled zero, m.")] = 0.02,
    limit: Limit = None,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Remove a specimen: relieve it slowly, switch the power off, say what it still carries.

    Example: damper-rig rig remove modbus://127.0.0.1:5020 --tare tare.json
    """
    from contextlib import closing

    from rigctl.clock import SystemClock
    from rigctl.player import connect
    from rigctl.procedures.mounting import MountingSettings
    from rigctl.procedures.mounting import remove as removed_by

    settings = MountingSettings(reach_m=reach, limit_n=limit)
    with closing(connect(url)) as transport:
        person = _operator(transport, "Removal of a specimen", yes=yes)
        stored = _tare(tare, transport)
        offset = 0.0 if stored is None else stored.offset_n
        here = removed_by(transport, SystemClock(), person, settings, tare_n=offset)
    _tell(f"removed at {1e3 * here.displacement_m:.2f} mm", asdict(here), None, as_json=as_json)


def jog(
    url: Url,
    to: Annotated[float | None, typer.Option(help="Displacement to move to, m.")] = None,
    by: Annotated[float, typer.Option(help="Displacement to move by, m.")] = 0.0,
    limit: Limit = None,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Move the piston slowly to a displacement (0: the centre) or by one, then switch the power off.

    Ctrl-C stops it at rest.

    Example: damper-rig rig jog modbus://127.0.0.1:5020 --to 0
    """
    from contextlib import closing

    from api.errors import InputError
    from rigctl.clock import SystemClock
    from rigctl.player import connect
    from rigctl.procedures.mounting import jog as jogged_by

    if (to is None) == (by == 0):
        raise InputError("jog: give --to or --by")
    with closing(connect(url)) as transport:
        _operator(transport, "A slow movement of the piston", yes=yes, start=True)
        here = jogged_by(transport, SystemClock(), to_m=to, by_m=by, limit_n=limit)
    text = f"{1e3 * here.displacement_m:.2f} mm, {here.force_n:.1f} N ± {2 * here.uncertainty_n:.1f} N"
    _tell(text, asdict(here), None, as_json=as_json)


def crawl(
    url: Url,
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_folder, help="Folder of the run file and of its result.")
    ],
    amplitude: Annotated[float, typer.Option(help="Amplitude, m.")] = 0.01,
    speed: Annotated[float, typer.Option(help="Speed, m/s.")] = 0.005,
    cycles: Annotated[int, typer.Option(help="Cycles after the first one.")] = 3,
    current: Annotated[float | None, typer.Option(help="Current of a controllable damper, A.")] = None,
    specimen: Annotated[str, typer.Option(help="Specimen, for the run file.")] = "",
    tare: TareFile = None,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Measure gas force, spring rate and friction with a triangle at crawl speed.

    Example: damper-rig rig crawl modbus://127.0.0.1:5020 -o crawl
    """
    from rigctl.procedures.crawl import CrawlSettings, crawl_of, crawl_test

    settings = CrawlSettings(amplitude_m=amplitude, speed_m_s=speed, cycles=cycles, current_a=current)
    path, run = _played(
        url,
        lambda rate_hz: crawl_test(replace(settings, sample_rate_hz=rate_hz)),
        output,
        specimen=specimen,
        tare=tare,
        yes=yes,
    )
    found = crawl_of(run)
    _tell(f"{path}: {found}", found.as_json(), path.with_suffix(".json"), as_json=as_json)


def weigh(
    url: Url,
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_folder, help="Folder of the run file and of its result.")
    ],
    with_specimen: Annotated[
        bool, typer.Option(help="A specimen is in, and linear for small motion: the mass is stated less sure.")
    ] = False,
    displacement: Annotated[float, typer.Option(help="Largest displacement, m.")] = 0.002,
    acceleration: Annotated[float, typer.Option(help="Largest acceleration, m/s².")] = 30.0,
    yes: Yes = False,
    as_json: Json = False,
) -> None:
    """Weigh what moves between load cell and specimen, with a small fast motion, for 'rig compensate'.

    Example: damper-rig rig weigh modbus://127.0.0.1:5020 -o weigh
    """
    from rigctl.procedures.weigh import WeighSettings, mass_of, weigh_test

    settings = WeighSettings(displacement_m=displacement, acceleration_m_s2=acceleration)
    path, run = _played(url, lambda rate_hz: weigh_test(replace(settings, sample_rate_hz=rate_hz)), output, yes=yes)
    found = mass_of(run, with_specimen=with_specimen)
    _tell(f"{path}: {found}", asdict(found), path.with_suffix(".json"), as_json=as_json)


def compensate(
    files: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Run files.")],
    mass: Annotated[Path, typer.Option(help="The mass, from 'damper-rig rig weigh'.")],
    output: Annotated[Path, typer.Option("-o", "--output", callback=to_folder, help="Folder of the new run files.")],
    bandwidth: Annotated[
        float, typer.Option(help="Frequency up to which the acceleration is right to 1 %, Hz.")
    ] = 80.0,
    as_json: Json = False,
) -> None:
    """Remove the inertia between load cell and specimen from the force of runs, offline; the runs themselves stay.

    Example: damper-rig rig compensate runs/*.h5 --mass weigh/weigh.json -o compensated
    """
    from api.cli.preparation import read_record
    from api.cli.terminal import answer
    from api.errors import InputError
    from rigctl.preparation import Mass
    from rigctl.procedures.compensate import compensate as compensated_by
    from rigctl.runfile import read_run, write_run

    weighed = read_record(mass, Mass)
    targets = [output / file.name for file in files]
    if taken := [target for target in targets if target.exists()]:
        raise InputError(f"{taken[0]}: exists already, a run is never overwritten: give another folder")
    made = [compensated_by(read_run(file), weighed, bandwidth_hz=bandwidth) for file in files]
    output.mkdir(parents=True, exist_ok=True)
    for target, one in zip(targets, made, strict=True):
        write_run(target, one.run)
    lines = [f"{target}: {one}" for target, one in zip(targets, made, strict=True)]
    content = [
        {"file": str(target), "uncertainty_n": one.uncertainty_n, "bandwidth_hz": one.bandwidth_hz}
        for target, one in zip(targets, made, strict=True)
    ]
    answer("\n".join(lines), content, as_json=as_json)


class _Yes:
    """Confirms everything: nobody stands at a simulated rig."""

    def confirm(self, text: str) -> None:
        pass

    def number(self, text: str, unit: str) -> float:
        from rigctl.errors import Declined

        raise Declined(f"no answer: {text}")


def _operator(transport: Transport, act: str, *, yes: bool, start: bool = False) -> Operator:
    """The person to ask. Where `start`, a real rig may move only after a yes, now; else the procedure asks for it.

    Raises InputError for --yes at a real rig.
    """
    from api.cli.person import Terminal
    from api.cli.start import ask_to_start, check_yes
    from rigctl.operator_acts import look

    if start:
        ask_to_start(transport, Terminal(), act, yes=yes)
    else:
        check_yes(look(transport)[0], yes)
    return _Yes() if yes else Terminal()


def _tare(path: Path | None, transport: Transport) -> Tare | None:
    from api.cli.person import Terminal
    from api.cli.preparation import setup_from

    return setup_from(Terminal(), transport, serial="", fixture="", oil="", calibration=None, tare=path).tare


def _played(
    url: str,
    test_at: Callable[[float], Test],
    folder: Path,
    *,
    specimen: str = "",
    tare: Path | None = None,
    yes: bool,
) -> tuple[Path, Run]:
    """Play one test, made for the rig's sample rate, after a yes; and read its run file."""
    from contextlib import closing

    from rigctl.operator_acts import look
    from rigctl.player import connect, play
    from rigctl.procedures.station import usual_rate_hz
    from rigctl.runfile import read_run
    from rigctl.setup import Setup

    with closing(connect(url)) as transport:
        test = test_at(usual_rate_hz(look(transport)[0]))
        setup = Setup(tare=_tare(tare, transport))
        _operator(transport, f"Test {test.name!r}", yes=yes, start=True)
        path = play(transport, test, folder, specimen=specimen, setup=setup)
    return path, read_run(path)


def _tell(text: str, content: dict[str, Any], output: Path | None, *, as_json: bool) -> None:
    from api.cli.preparation import write_record
    from api.cli.terminal import answer

    if output is not None:
        write_record(output, content)
    answer(text, content, as_json=as_json)
