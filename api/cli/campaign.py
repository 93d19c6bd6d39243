"""``damper-rig campaign …``: campaigns of a service, over HTTP."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from api.cli.places import to_folder

if TYPE_CHECKING:
    from api.client import Campaign, Client

__all__ = ["AsJson", "ServiceUrl", "campaign", "connected"]

campaign = typer.Typer(
    name="campaign", help="Submit campaigns to a service, follow and end them, fetch their runs.", no_args_is_help=True
)

Id = Annotated[str, typer.Argument(metavar="ID", help="The campaign.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")]
ServiceUrl = Annotated[
    str | None,
    typer.Option(
        "--service", metavar="URL", help="Default: DAMPER_RIG_SERVICE, else this computer. Key: DAMPER_RIG_KEY(_FILE)."
    ),
]


@campaign.command("submit")
def submit(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A campaign or plan (TOML, JSON), or a plan or excitation file (.h5, .csv)."
        ),
    ],
    rig: Annotated[str | None, typer.Option(help="The rig's address.")] = None,
    specimen: Annotated[str | None, typer.Option(help="What is in the rig.")] = None,
    name: Annotated[str | None, typer.Option(help="Name of the campaign; default: that of the file.")] = None,
    once: Annotated[
        str, typer.Option(metavar="KEY", help="Any text: sent again with it, the campaign is not scheduled twice.")
    ] = "",
    watch_it: Annotated[bool, typer.Option("--watch", help="Follow it until it has ended.")] = False,
    service: ServiceUrl = None,
    as_json: AsJson = False,
) -> None:
    """Schedule a campaign: the keys of POST /v1/campaigns in a file; options stand above the file.

    A plan in HDF5 or CSV, and an excitation file as 'damper-rig run' plays it, are stored as a design of the service;
    so is a plan that replays records of this computer, with their samples.

    Example: damper-rig campaign submit plan.toml --rig modbus://127.0.0.1:5020 --specimen "damper 7" --watch
    """
    from api.cli.campaign_file import read_campaign, sendable

    body = read_campaign(file, rig=rig, specimen=specimen, name=name)
    with connected(service) as client, sendable(file, body) as (sent, body):
        if sent is not None:
            body["design"] = client.send_plan(sent)
        accepted = client.submit(body, key=once)
        if watch_it:
            _watch(client, accepted.id, as_json)
        else:
            _print(accepted, as_json)


@campaign.command("list")
def list_campaigns(
    state: Annotated[str, typer.Option(help="Only those in this state: accepted, running, …")] = "",
    limit: Annotated[int, typer.Option(min=1, max=200, help="At most so many.")] = 20,
    service: ServiceUrl = None,
    as_json: AsJson = False,
) -> None:
    """List campaigns, the newest first.

    Example: damper-rig campaign list --state running
    """
    from dataclasses import asdict

    from api.cli.terminal import answer

    with connected(service) as client:
        found = client.campaigns(limit=limit, state=state)
    answer("\n".join(map(_line, found)) or "no campaigns", [asdict(one) for one in found], as_json=as_json)


@campaign.command("watch")
def watch(campaign_id: Id, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """Follow a campaign until it has ended. Exit status 0: done; 1: failed or aborted. Ctrl-C ends only the watching.

    Example: damper-rig campaign watch 3f6c…
    """
    with connected(service) as client:
        _watch(client, campaign_id, as_json)


@campaign.command("hold")
def hold(campaign_id: Id, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """Bring the rig to rest under power; the campaign waits until it is resumed.

    Example: damper-rig campaign hold 3f6c…
    """
    with connected(service) as client:
        _print(client.hold(campaign_id), as_json)


@campaign.command("resume")
def resume(campaign_id: Id, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """Go on with a campaign that is held: the rig moves.

    Example: damper-rig campaign resume 3f6c…
    """
    with connected(service) as client:
        _print(client.resume(campaign_id), as_json)


@campaign.command("stop")
def stop(campaign_id: Id, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """End a campaign: the rig comes to rest, travels back to mid-stroke without current, and powers off.

    This is no emergency stop: where somebody is in danger, press the button.

    Example: damper-rig campaign stop 3f6c…
    """
    with connected(service) as client:
        _print(client.stop(campaign_id), as_json)


@campaign.command("abort")
def abort(campaign_id: Id, service: ServiceUrl = None, as_json: AsJson = False) -> None:
    """End a campaign: the rig comes to rest and powers off where the piston stands.

    Example: damper-rig campaign abort 3f6c…
    """
    with connected(service) as client:
        _print(client.abort(campaign_id), as_json)


@campaign.command("fetch")
def fetch(
    campaign_id: Id,
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_folder, metavar="DIR", help="Output folder.")
    ] = Path("runs"),
    test: Annotated[list[str] | None, typer.Option(help="Only the runs of this test; may be given again.")] = None,
    service: ServiceUrl = None,
    as_json: AsJson = False,
) -> None:
    """Download the run files of a campaign, checked by SHA-256; a download that was interrupted goes on where it ended.

    Example: damper-rig campaign fetch 3f6c… -o runs
    """
    from api.cli.campaign_file import names_of
    from api.cli.terminal import answer, progress_bar
    from api.errors import NotFound

    with connected(service) as client, progress_bar("fetching") as bar:
        runs = [run for run in client.runs(campaign_id) if not test or run.test in test]
        if not runs:
            raise NotFound(f"campaign {campaign_id} has no run{' of these tests' if test else ''} yet")
        total = sum(run.size_bytes for run in runs)
        paths, before = [], 0
        for run, name in zip(runs, names_of(runs), strict=True):

            def tell(done: float, before: int = before, size: int = run.size_bytes, name: str = name) -> None:
                bar((before + done * size) / total, name)

            paths.append(client.fetch(run, output, name=name, tell=tell))
            before += run.size_bytes
    value = [{"file": str(path), "test": run.test, "id": run.id} for run, path in zip(runs, paths, strict=True)]
    answer("\n".join(map(str, paths)), value, as_json=as_json)


def connected(url: str | None) -> Client:
    """A client of the service that the option, the environment or the default names."""
    import os

    from api.client import Client, find_service

    return Client(find_service(os.environ, url=url))


def _watch(client: Client, campaign_id: str, as_json: bool) -> None:
    from api.cli.terminal import progress_bar

    campaign_id = client.campaign(campaign_id).id  # an unknown one is refused before the bar
    try:
        _say(f"watching {campaign_id}; Ctrl-C ends only the watching")
        with progress_bar("waiting") as bar:
            ended = client.watch(campaign_id, tell=lambda now: bar(_share(now), _progress(now)))
    except KeyboardInterrupt:
        _say(f"no longer watching; the campaign goes on. To end it: damper-rig campaign stop {campaign_id}")
        raise typer.Exit(1) from None
    _print(ended, as_json)
    if ended.state != "done":
        raise typer.Exit(1)


def _share(now: Campaign) -> float:
    return 1.0 - now.left_s / now.rig_time_s if now.rig_time_s else 0.0


def _progress(now: Campaign) -> str:
    if now.question:
        return f"it asks its operator: {now.question}"
    if now.state == "accepted":
        return "waiting for its rig"
    running = next((test for test in now.tests if test.state == "running"), None)
    where = f"{running.name}: {running.phase}" if running else now.state
    minutes, seconds = divmod(round(now.left_s), 60)
    return f"{where}{f', {now.asked} asked for' if now.asked else ''}, {minutes}:{seconds:02d} left"


def _line(one: Campaign) -> str:
    why = f": {one.reason}" if one.reason else ""
    return f"{one.number:6d}  {one.id}  {one.state:8}  {one.created[:19]}  {one.name} on {one.rig}{why}"


def _print(one: Campaign, as_json: bool) -> None:
    from dataclasses import asdict

    from api.cli.terminal import answer

    why = f": {one.reason}" if one.reason else f", {one.asked} asked for" if one.asked else ""
    played = sum(test.state == "done" for test in one.tests)
    value: dict[str, Any] = {**asdict(one), "left_s": one.left_s}  # Any: JSON
    text = f"{one.id}: {one.state}{why}; {played} of {len(one.tests)} tests done, {one.left_s:.0f} s of rig time left"
    answer(text, value, as_json=as_json)


def _say(text: str) -> None:
    import sys

    print(f"damper-rig: {text}", file=sys.stderr, flush=True)
