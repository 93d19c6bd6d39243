"""``damper-rig align``: channels of another data acquisition in a run file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.places import to_file

__all__ = ["align"]


def align(
    run: Annotated[Path, typer.Argument(metavar="RUN.h5", help="Run file of the rig.")],
    record: Annotated[
        Path, typer.Argument(metavar="RECORD", help="Record of the other acquisition: .csv, or RPC III (.rsp, .drv).")
    ],
    take: Annotated[
        list[str],
        typer.Option(metavar="THEIRS[=OURS]", help="A channel to take, and its name in the run file, e.g. Load=force."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", callback=to_file, help="Run file to write.")],
    pulse: Annotated[
        str, typer.Option(metavar="THEIRS=OURS", help="Channels in which both have recorded the same pulses.")
    ] = "",
    level: Annotated[
        float | None, typer.Option(help="Value at which a pulse counts as risen, SI; default: its middle.")
    ] = None,
    trigger: Annotated[
        float | None, typer.Option(help="Time from the record's first sample to the run's sample 0, s, by a trigger.")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(help="Tolerance of both clocks together, ppm; only with --trigger.")
    ] = 100.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the alignment as JSON.")] = False,
) -> None:
    """Put channels that another data acquisition has recorded into a run file, on the clock of the run.

    The clocks are related by synchronisation pulses that both have recorded (delay and drift), or by a trigger (delay;
    the drift is uncertain by the tolerance). Every channel is resampled once; the uncertainty is printed and written
    into the run file.

    Example: damper-rig align runs/sine.h5 daq.csv --take Load=force --pulse Coil=current -o aligned.h5
    """
    from api.cli.terminal import answer
    from rigctl.errors import AlignmentError
    from rigctl.runfile import read_run, write_run
    from rigctl.second_acquisition import by_pulse, by_trigger, merged, read_record

    if bool(pulse) == (trigger is not None):
        raise AlignmentError("give --pulse THEIRS=OURS or --trigger SECONDS, and not both: one relates the clocks")
    own, other = read_run(run), read_record(record)
    if trigger is not None:
        relation = by_trigger(own, other, trigger, tolerance * 1e-6)
    else:
        theirs, _, ours = pulse.partition("=")
        relation = by_pulse(own, other, ours or theirs, theirs, level)
    names = {one.partition("=")[0]: one.partition("=")[2] or one for one in take}
    found = merged(own, other, relation, names)
    write_run(output, found.run)
    lines = [str(relation), f"timing within the run: ± {2 * found.timing_u_s:.2g} s (k = 2)"]
    lines += [
        f"{name}: ± {2 * u:.3g} {found.run.units[name]} by the alignment (k = 2)" for name, u in found.channel_u.items()
    ]
    answer(
        "\n".join([*lines, str(output)]),
        {
            "file": str(output),
            "delay_s": relation.delay_s,
            "delay_u_s": relation.delay_u_s,
            "drift": relation.drift,
            "drift_u": relation.drift_u,
            "timing_u_s": found.timing_u_s,
            "channel_u": dict(found.channel_u),
        },
        as_json=as_json,
    )
