"""The steps of the demonstration, each with real processes, a real connection and real files."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from api.client import Campaign, Client, Service
from api.demo.campaign import campaign
from api.errors import Conflict, InputError, ProcessError
from api.processes.child import Child
from identification.discrepancy import explain, report_data, write_report
from identification.physical.modelfile import read_model
from rigctl.runfile import Run, read_run
from sim_rig.draw import draw

__all__ = ["Asked", "Bar", "Demonstration", "Finding", "Show", "demonstrate", "judged"]

DATA = Path(__file__).parent / "data"
SPECIMEN = "semi-active"
SPEED = 20.0
CAMPAIGN_S = 170.0
POLL_S = 0.2
MARK = ".damper-rig-demo"  # marks a folder whose files a new demonstration may remove
MADE = ("runs", "service", "rig", "real", "report.html", "sim.log", "service.log")
REAL_HELD_OUT = ("ensaio_A_4", "ensaio_A_8")


class Bar(Protocol):
    """Sets the bar of a name to the share done, 0 … 1; ``text`` describes the step."""

    def __call__(self, name: str, done: float, text: str = "") -> None: ...


class Show(Protocol):
    """Shows the progress of the demonstration."""

    def step(self, number: int, text: str) -> None: ...

    def say(self, text: str) -> None: ...

    def bars(self) -> AbstractContextManager[Bar]:
        """Bars by name, each from 0 to 1."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """Options of the demonstration. An empty ``effect``: the seed selects one."""

    output: Path
    seed: int
    effect: str = ""

    @property
    def hidden(self) -> str:
        return self.effect or "random"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One explained gap: the report's data and its folder. Any: JSON."""

    title: str
    report: Mapping[str, Any]
    folder: Path
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Demonstration:
    """The results. ``truth``: the effects that were hidden, read only at the end."""

    asked: Asked
    campaign: Campaign
    rig: Finding
    real: Finding
    truth: tuple[str, ...]

    @property
    def named(self) -> tuple[str, ...]:
        """The effects that were found in the rig."""
        return tuple(effect["element"] for effect in self.rig.report["effects"])

    @property
    def named_right(self) -> bool:
        return self.named == self.truth


def judged(named: Sequence[str], truth: Sequence[str]) -> str:
    """What came out of the search for what was hidden, in two words: without a name nothing is named wrong."""
    if not named:
        return "not named"
    return "named right" if tuple(named) == tuple(truth) else "named wrong"


def demonstrate(asked: Asked, show: Show) -> Demonstration:
    """Run all steps.

    Raises InputError or SpecimenError for options that cannot be used, ProcessError where a process fails. When this
    returns or raises, also after an interruption, the rig is safe and every process has ended.
    """
    draw(SPECIMEN, (asked.hidden,), asked.seed)  # refuses an effect or a seed before anything starts
    out = prepare_output(asked.output)
    show.say(f"Demonstration with seed {asked.seed}, output folder {asked.output}")
    played, paths = _measure(asked, out, show)
    show.step(5, "Fit the base model, explain the gap, check on held-out runs")
    rig = _explain(
        "Simulated rig",
        DATA / "semi_active_as_simulated.json",
        [read_run(path) for path, held_out in paths if not held_out],
        [read_run(path) for path, held_out in paths if held_out],
        out / "rig",
        show,
    )
    show.step(6, "The same on a real magneto-rheological damper: fit a viscous damper, explain")
    train, held = _real_runs()
    real = _explain("Measured MR damper", DATA / "viscous.json", train, held, out / "real", show)
    truth = tuple(item.effect for item in draw(SPECIMEN, (asked.hidden,), asked.seed).hidden)
    return Demonstration(asked=asked, campaign=played, rig=rig, real=real, truth=truth)


def prepare_output(output: Path) -> Path:
    """The output folder, emptied except for its mark; raises InputError where it contains other files."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{output}: cannot be made ({error.strerror}): give another folder") from error
    mark = output / MARK
    if not mark.exists() and any(output.iterdir()):
        raise InputError(f"{output}: the folder is not empty: give a new one, or an earlier demonstration's")
    mark.touch()
    for name in MADE:
        path = output / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
    return output.absolute()


def _measure(asked: Asked, out: Path, show: Show) -> tuple[Campaign, list[tuple[Path, bool]]]:
    """Steps 1 to 4: the campaign at its end, and its run files with whether they are held out."""
    with _processes(asked, out, show) as (rig_url, service_url), Client(Service(url=service_url)) as client:
        show.step(3, "Schedule a campaign over HTTP")
        accepted = client.submit(campaign(rig_url))
        show.say(_plan_text(accepted))
        show.step(4, "Stream the tests to the rig, capture one run file each")
        played = _follow(client, accepted, show)
        return played, _fetch(client, played, out / "runs")


@contextmanager
def _processes(asked: Asked, out: Path, show: Show) -> Iterator[tuple[str, str]]:
    """The rig and the service, both running; at the end the service is stopped first: it makes the rig safe."""
    show.step(1, "Start a simulated servo-hydraulic rig in a process of its own")
    rig_arguments = ["sim", "--listen", "modbus://127.0.0.1:0", "--specimen", SPECIMEN]
    rig_arguments += ["--hide", asked.hidden, "--seed", str(asked.seed), "--speed", f"{SPEED:g}"]
    service_arguments = ["serve", "--data", str(out / "service"), "--host", "127.0.0.1", "--port", "0"]
    service_arguments += ["--database", f"sqlite:///{out / 'service' / 'damper-rig.db'}"]
    hidden = asked.effect or f"one effect, selected by seed {asked.seed}"
    with Child(rig_arguments, out / "sim.log") as rig, Child(service_arguments, out / "service.log") as service:
        show.say(f"{SPECIMEN} damper at {rig.wait_until_ready(120.0)}, hidden in it: {hidden}")
        show.step(2, "Start the service")
        show.say(f"live page: {service.wait_until_ready()}")
        yield rig.url, service.url


def _plan_text(accepted: Campaign) -> str:
    held_out = sum(test.held_out for test in accepted.tests)
    return f"{len(accepted.tests)} tests, {accepted.rig_time_s:.0f} s of rig time, {held_out} of them held out"


def _follow(client: Client, accepted: Campaign, show: Show) -> Campaign:
    """The campaign at its end; an interruption stops it and waits for the rig."""
    with show.bars() as bar:

        def tell_bars(now: Campaign) -> None:
            for test in now.tests:
                if test.state in ("running", "done"):
                    bar(test.name, test.done)

        try:
            played = client.watch(accepted.id, within_s=CAMPAIGN_S, tell=tell_bars, poll_s=POLL_S)
        except BaseException:
            with suppress(ProcessError, Conflict):  # where this fails too, the end of the service stops the rig
                client.abort(accepted.id)
                client.watch(accepted.id, within_s=10.0, poll_s=POLL_S)
            raise
    if played.state != "done":
        raise ProcessError(f"the campaign is {played.state}: {played.reason}")
    return played


def _fetch(client: Client, played: Campaign, folder: Path) -> list[tuple[Path, bool]]:
    return [(client.fetch(run, folder), run.held_out) for run in client.runs(played.id)]


def _explain(
    title: str, model: Path, train: Sequence[Run], held_out: Sequence[Run], folder: Path, show: Show
) -> Finding:
    started = time.monotonic()
    with show.bars() as bar:
        found = explain(read_model(model), train, held_out, on_progress=lambda text, done: bar(title, done, text))
        write_report(found, folder, runs=[*train, *held_out])
    return Finding(title=title, report=report_data(found), folder=folder, seconds=time.monotonic() - started)


def _real_runs() -> tuple[list[Run], list[Run]]:
    paths = sorted((DATA / "mr_utfpr").glob("*.h5"))
    return (
        [read_run(path) for path in paths if path.stem not in REAL_HELD_OUT],
        [read_run(path) for path in paths if path.stem in REAL_HELD_OUT],
    )
