"""What a test may need beyond Python: named when it is missing, and never missing in silence where all is due."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import pytest
from hypothesis import HealthCheck, settings

# No deadline for a call, nor for the making of examples: a busy computer is not a fault.
# `make bench` draws the thorough number of examples.
BUSY = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("any computer", max_examples=30, **BUSY)
settings.register_profile("thorough", max_examples=300, **BUSY)
settings.load_profile("any computer")

REQUIRE_ALL = "DAMPER_RIG_REQUIRE_ALL"
POSTGRESQL = "DAMPER_RIG_TEST_POSTGRESQL"


def missing(what: str) -> None:
    """Skip, saying what is missing; where everything is due (in CI) that is a failure."""
    if os.environ.get(REQUIRE_ALL):
        pytest.fail(f"{what}; {REQUIRE_ALL} is set, so this must run")
    pytest.skip(what)


@pytest.fixture
def postgresql_url() -> Iterator[str]:
    """An empty database of its own on the server that the environment names."""
    from sqlalchemy import create_engine, make_url, text

    server = os.environ.get(POSTGRESQL)
    if not server:
        missing(
            f"no PostgreSQL: set {POSTGRESQL} to the address of a server on which databases may be made, "
            "for example postgresql+psycopg://postgres@127.0.0.1:5432/postgres"
        )
    name = f"damper_rig_test_{uuid4().hex[:12]}"
    engine = create_engine(str(server), isolation_level="AUTOCOMMIT", connect_args={"connect_timeout": 5})
    with engine.connect() as connection:
        connection.execute(text(f"CREATE DATABASE {name}"))
    yield make_url(str(server)).set(database=name).render_as_string(hide_password=False)
    with engine.connect() as connection:
        connection.execute(text(f"DROP DATABASE {name} WITH (FORCE)"))
    engine.dispose()


@pytest.fixture(scope="session")
def chromium() -> Path:
    """The browser that the page is looked at with."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        missing("no browser: put Chromium on the PATH")
    return Path(str(found))


LONG_FIRST = (  # files of some 7 s and more, longest first: begun last, one would run alone while a core rests
    "test_naming.py",
    "test_vehicle_studies.py",
    "test_demo.py",
    "test_machines.py",
    "test_playing.py",
    "test_reference_lines.py",
    "test_explanations.py",
    "test_samples.py",
    "test_jobs.py",
    "test_service.py",
    "test_rig_commands.py",
    "test_readme.py",
    "test_docs.py",
    "test_autopilot.py",
    "test_ordinary.py",
    "test_naming_of_hidden_cases.py",
    "test_page.py",
    "test_identify_job.py",
    "test_compute.py",
    "test_backup.py",
    "test_vehicle_job.py",
    "test_few_descriptors.py",
    "test_search.py",
    "test_replay.py",
    "test_clock_jumps.py",
    "test_fmu_stepping.py",
    "test_faults.py",
    "test_ending_signals.py",
    "test_killed.py",
    "test_hostile_imports.py",
    "test_queues.py",
    "test_full_disk_midway.py",
    "test_service_lines.py",
    "test_design_command.py",
    "test_command_line.py",
    "test_complexity.py",
    "test_band.py",
    "test_hostile_model_files.py",
    "test_beside.py",
    "test_stops.py",
    "test_page_requests.py",
    "test_uploads.py",
    "test_long_checks.py",
    "test_gas_heat.py",
    "test_holding.py",
    "test_hostile_plans.py",
    "test_report.py",
    "test_study_commands.py",
    "test_job_memory.py",
    "test_full_disk.py",
    "test_transports.py",
    "test_page_keyboard.py",
    "test_wheel.py",
    "test_identify_refuses.py",
    "test_laboratory_commands.py",
    "test_idempotency.py",
    "test_determinism.py",
    "test_campaign_store.py",
    "test_access_network.py",
    "test_fmu.py",
    "test_multiaxis.py",
    "test_passes.py",
    "test_signals.py",
    "test_access_page.py",
    "test_homogenise.py",
    "test_crest.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files in the order in which they are handed to the workers: the long ones first."""
    rank = {name: k for k, name in enumerate(LONG_FIRST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))


def pytest_configure() -> None:
    """Give child processes the signals that a terminal gives them: nohup and background shells ignore some of them.

    They also keep their bytecode, beside the compiled loops that they keep anyway: without it each of some hundred
    starts compiles the sources again, for 0.15 s. So does this process: to rewrite the assertions of all tests anew
    takes each worker some seconds.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        for number in (signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, signal.SIG_DFL)
