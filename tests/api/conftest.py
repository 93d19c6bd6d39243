"""Fixtures of api: a store on each database, and a campaign that is accepted."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import update

from api.campaigns.rig_store import RigStore
from api.campaigns.store import CampaignStore
from api.store.database import Database
from api.store.leases import holders
from api.store.tables import jobs
from excitation.files import write_excitation
from excitation.kinds import Kind
from excitation.signal import Excitation
from rigctl.address import connect
from rigctl.operator_acts import reset, stop
from rigctl.runfile import write_run
from tests.api.measured import MODEL, NAMES, a_run
from tests.starting import Started


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.postgresql)])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "postgresql":
        url: str = request.getfixturevalue("postgresql_url")
        return url
    return f"sqlite:///{tmp_path / 'store' / 'campaigns.db'}"


class Steady:
    """The steady clock of this process, which a test lets run ahead."""

    ahead_s = 0.0

    def __call__(self) -> float:
        return time.monotonic() + self.ahead_s


@pytest.fixture
def steady() -> Steady:
    return Steady()


@pytest.fixture
def database(database_url: str, steady: Steady) -> Iterator[Database]:
    with Database(database_url, clock=steady) as opened:
        yield opened


@pytest.fixture
def store(database: Database) -> CampaignStore:
    return CampaignStore(database)


@pytest.fixture
def rigs(database: Database) -> RigStore:
    return RigStore(database)


@pytest.fixture
def pass_time(database: Database, steady: Steady) -> Callable[[float], None]:
    """Let seconds pass for every lease, as this process has seen it, and for every end of a job."""

    def passed(seconds: float) -> None:
        with database.writing() as connection:
            holders(connection, database.sightings)  # it has seen them all
            connection.execute(update(jobs).values(ended_at_s=jobs.c.ended_at_s - seconds))
        steady.ahead_s += seconds

    return passed


@pytest.fixture
def body() -> dict[str, Any]:
    """A campaign of two short sines, the second held out."""
    sine = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2}
    return {
        "name": "two sines",
        "rig": "modbus://127.0.0.1:5020",
        "specimen": "damper 7",
        "tests": [
            {"name": "slow", **sine, "current": 0.5},
            {"name": "fast", **sine, "frequency": 8.0, "held_out": True, "current": 0.5},
        ],
    }


@pytest.fixture
def rig(shared_rig: str) -> str:
    """The address of a simulated rig without a latched fault: an operator has reset it."""
    with closing(connect(shared_rig)) as wire:
        wire.identify(2.0)
        stop(wire)
        reset(wire)
    return shared_rig


@pytest.fixture
def fresh_rig(tmp_path: Path) -> Iterator[str]:
    """A simulated rig of its own: what it measures does not depend on the tests before."""
    with Started(
        ["sim", "--listen", "modbus://127.0.0.1:0", "--seed", "3", "--speed", "10"], tmp_path / "sim.log"
    ) as child:
        yield child.wait_until_ready(120.0)


@pytest.fixture(scope="session")
def shared_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a simulated rig that runs as a process of its own, ten times faster than real time."""
    log = tmp_path_factory.mktemp("rig") / "sim.log"
    with Started(["sim", "--listen", "modbus://127.0.0.1:0", "--seed", "3", "--speed", "10"], log) as child:
        yield child.wait_until_ready(120.0)


@pytest.fixture
def service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Started]:
    """The service as a process of its own, on SQLite, with a lease short enough to wait for its end."""
    monkeypatch.setenv("DAMPER_RIG_LEASE_S", "3")
    with Started(["serve", "--data", str(tmp_path / "lab"), "--port", "0"], tmp_path / "serve.log") as child:
        child.wait_until_ready()
        yield child


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four good runs, a model, and a run that explain refuses."""
    place = tmp_path_factory.mktemp("measured")
    for k, (name, frequency) in enumerate(zip(NAMES, (1.0, 2.0, 4.0, 2.5), strict=True)):
        write_run(place / name, a_run(k, frequency))
    write_run(place / "reversed.h5", a_run(5, 2.0, sign=-1.0))
    (place / "model.json").write_text(json.dumps(MODEL))
    return place


@pytest.fixture
def road(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with ``road.h5``: three seconds that repeat nothing."""
    monkeypatch.chdir(tmp_path)
    spectrum, f = np.zeros(2049), np.fft.rfftfreq(4096, 1e-3)
    band = (f > 0.5) & (f < 25)
    spectrum[band] = f[band] ** -0.7
    x = np.fft.irfft(spectrum * np.fft.rfft(np.random.default_rng(3).standard_normal(4096)))[:3000]
    excitation = Excitation(
        kind=Kind.ROAD,
        sample_rate_hz=1000.0,
        period_samples=0,
        displacement_m=0.008 * x / np.max(np.abs(x)),
        current_a=np.full(3000, 0.8),
    )
    write_excitation(tmp_path / "road.h5", excitation)
    return tmp_path


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lab")


@pytest.fixture(scope="module")
def base(lab: Path) -> Iterator[str]:
    """The address of a service that the tests of a module share."""
    with Started(["serve", "--data", str(lab / "data"), "--port", "0"], lab / "serve.log") as child:
        yield child.wait_until_ready()
