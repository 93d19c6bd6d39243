"""Every executor gives the same values, in the same order, to the bit; and says what failed."""

from __future__ import annotations

import math
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from identification.compute import (
    Cluster,
    Executor,
    Processes,
    Serial,
    Threads,
    available_workers,
    chosen,
    executor_from,
    finished,
    run,
    run_here,
    using,
    workers_from,
)
from identification.compute.workers import processors_of_quota
from identification.discrepancy import explain, report_data
from identification.errors import Cancelled, ComputeError, WorkerLost
from identification.fitting import fit_from_many
from tests.identification.loopback_cluster import dask_on_loopback
from tests.identification.specimens import AS_SIMULATED, records_with
from tests.identification.specimens import run as measured
from tests.identification.tasks import (
    Told,
    blas_threads,
    killed,
    of_two_failures,
    process_of,
    size_of,
    slow_root,
    smoothed,
    sums,
    told_and_stuck,
    touched,
)

ROOT = Path(__file__).parents[2]
HERE = ("serial", "threads", "processes")
CLUSTER = pytest.param("cluster", marks=pytest.mark.slow)
ALL = (*HERE, CLUSTER)
ELSEWHERE = ("processes", CLUSTER)


@pytest.fixture(scope="module")
def executors() -> Iterator[dict[str, Executor]]:
    made: dict[str, Executor] = {"serial": Serial(), "threads": Threads(3), "processes": Processes(2)}
    yield made
    for executor in made.values():
        executor.close()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Executor]:
    with dask_on_loopback(tmp_path_factory.mktemp("dask")) as dask:
        dask.add_workers(2)
        with closing(Cluster(dask.address, threads=2)) as cluster:
            yield cluster


@pytest.fixture
def executor(request: pytest.FixtureRequest, executors: dict[str, Executor]) -> Iterator[Executor]:
    chosen = request.getfixturevalue("cluster") if request.param == "cluster" else executors[request.param]
    with using(chosen):
        yield chosen


def on(*names: Any) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("executor", names, indirect=True)


@on(*ALL)
def test_values_are_those_of_a_plain_loop_to_the_bit_and_in_its_order(executor: Executor) -> None:
    rng = np.random.default_rng(0)
    signals = [rng.standard_normal(size) for size in rng.integers(10, 3000, 40)]
    window = rng.standard_normal(9)
    values = run(partial(smoothed, window=window), signals)
    assert [v.tobytes() for v in values] == [smoothed(s, window).tobytes() for s in signals]


@on(*ALL)
def test_tasks_use_one_blas_thread_each_and_what_comes_after_as_many_as_before(executor: Executor) -> None:
    with threadpool_limits(2, user_api="blas"):
        assert run(blas_threads, [0, 1, 2]) == [1, 1, 1]
        assert blas_threads(0) == 2


@on(*ALL)
def test_no_item_gives_no_value_and_one_gives_one(executor: Executor) -> None:
    told: list[tuple[int, int]] = []
    assert run(math.sqrt, [], on_done=lambda *done: told.append(done)) == []
    assert told == []
    assert run(math.sqrt, [4.0]) == [2.0]


@on(*ALL)
def test_progress_counts_every_task_in_the_thread_that_asks(executor: Executor) -> None:
    told: list[tuple[int, int, threading.Thread]] = []
    run(math.sqrt, range(12), on_done=lambda done, total: told.append((done, total, threading.current_thread())))
    assert told == [(k + 1, 12, threading.current_thread()) for k in range(12)]


@on(*ALL)
def test_values_come_as_they_are_ready_each_once(executor: Executor) -> None:
    assert sorted(finished(math.sqrt, [0.0, 1.0, 4.0])) == [(0, 0.0), (1, 1.0), (2, 2.0)]


@on(*ALL)
def test_of_several_that_fail_the_first_in_order_is_told_and_the_executor_works_on(executor: Executor) -> None:
    for _ in range(3):
        with pytest.raises(ValueError, match="first"):
            run(of_two_failures, [1, 2, -1, 3, -2, 4])
    assert run(math.sqrt, [9.0]) == [3.0]


@on(*ALL)
def test_after_a_failure_nothing_more_begins(executor: Executor, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="negative"):
        run(partial(touched, folder=tmp_path), [1, -1, *range(2, 2000)])
    assert len(list(tmp_path.iterdir())) < 1998


@on(*ALL)
def test_what_is_cancelled_ends_and_nothing_more_begins(executor: Executor, tmp_path: Path) -> None:
    token = threading.Event()

    def on_done(done: int, total: int) -> None:
        if done == 3:
            token.set()

    with using(executor, token.is_set), pytest.raises(Cancelled):
        run(partial(touched, folder=tmp_path), range(2000), on_done=on_done)
    assert run(math.sqrt, [9.0, 4.0]) == [3.0, 2.0], "the executor is as good as new"
    assert len(list(tmp_path.iterdir())) < 2000  # what was already sent to a cluster may still end
    with using(executor, lambda: True), pytest.raises(Cancelled):
        run(math.sqrt, [1.0])


@on(*ELSEWHERE)
def test_a_task_elsewhere_that_never_ends_holds_up_no_cancellation(executor: Executor, tmp_path: Path) -> None:
    pipes = tmp_path / "told", tmp_path / "awaited"
    for pipe in pipes:
        os.mkfifo(pipe)
    running = threading.Event()
    listener = threading.Thread(target=lambda: (pipes[0].open().close(), running.set()))
    listener.start()
    with using(executor, running.is_set), pytest.raises(Cancelled):
        run(told_and_stuck, [pipes])
    listener.join()
    if isinstance(executor, Cluster):  # its workers are not ours to end: this one is let go
        with pipes[1].open("w"):
            pass
    else:
        with pytest.raises(OSError, match="No such device"):  # nobody reads any more
            os.open(pipes[1], os.O_WRONLY | os.O_NONBLOCK)
    assert run(math.sqrt, [9.0]) == [3.0]


@on(*ALL)
def test_a_task_may_wait_for_tasks_of_its_own(executor: Executor) -> None:
    with using(Serial()):
        expected = [sums(3, at) for at in (0.0, 1.0, 2.0)]
    assert run(partial(sums, 3), [0.0, 1.0, 2.0]) == expected


def test_however_deep_tasks_are_nested_no_more_threads_work_than_were_asked_for() -> None:
    seen: set[int] = set()

    def task(depth: int) -> None:
        seen.add(threading.get_ident())
        math.factorial(500)
        if depth:
            run(task, [depth - 1] * 5)

    with closing(Threads(3)) as threads, using(threads):
        run(task, [3] * 5)
    assert len(seen) <= 3


def test_threads_run_at_once() -> None:
    met = threading.Barrier(2, timeout=60.0)

    def task(k: int) -> int:
        met.wait()
        return k * k

    with closing(Threads(2)) as threads, using(threads):
        assert run(task, [3, 4]) == [9, 16]


def test_a_cancellation_reaches_the_tasks_of_a_task() -> None:
    token, done = threading.Event(), list[float]()

    def inner(at: float) -> None:
        done.append(at)
        token.set()

    def outer(_: int) -> None:
        run_here(inner, [0.0] * 1000)

    with closing(Threads(2)) as threads, using(threads, token.is_set), pytest.raises(Cancelled):
        run(outer, [0] * 4)
    assert len(done) < 1000


@on(*ELSEWHERE)
def test_what_all_tasks_share_is_read_by_processes_and_not_by_tasks(executor: Executor, tmp_path: Path) -> None:
    assert run(partial(size_of, shared=Told(tmp_path, 2)), range(50)) == list(range(0, 100, 2))
    assert 1 <= len(list(tmp_path.iterdir())) <= 2 * executor.workers


def test_a_worker_process_that_is_killed_is_told_in_a_line_and_replaced() -> None:
    with closing(Processes(2)) as processes, using(processes):
        with pytest.raises(WorkerLost, match="worker process ended") as told:
            run(killed, range(5))
        assert "\n" not in str(told.value)
        assert os.getpid() not in run(process_of, range(4))


_ABANDONED = """
import os
from pathlib import Path
from identification.compute import Processes, run, using
from tests.identification.tasks import told_and_stuck

if __name__ == "__main__":
    with using(Processes(2)):
        run(told_and_stuck, [(Path({told!r}), Path({awaited!r}))])
"""


def test_worker_processes_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    told, awaited = tmp_path / "told", tmp_path / "awaited"
    for pipe in (told, awaited):
        os.mkfifo(pipe)
    script = tmp_path / "abandoned.py"
    script.write_text(_ABANDONED.format(told=str(told), awaited=str(awaited)), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    parent = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, env=environment)
    with told.open():
        parent.kill()
    parent.communicate(timeout=60.0)  # to the end of an output that the workers have too


@pytest.mark.slow
def test_a_cluster_of_two_of_which_one_is_killed_half_way_completes_the_work(tmp_path: Path) -> None:
    with dask_on_loopback(tmp_path) as dask:
        one, _ = dask.add_workers(2)

        def on_done(done: int, total: int) -> None:
            if done == total // 2:
                one.kill()

        with closing(Cluster(dask.address, threads=1)) as cluster, using(cluster):
            assert cluster.workers == 2
            assert run(slow_root, range(60), on_done=on_done) == [math.sqrt(k) for k in range(60)]
            one.wait()
            assert cluster.workers == 1


def test_a_cluster_that_is_lost_is_told_in_a_line(tmp_path: Path) -> None:
    with dask_on_loopback(tmp_path) as dask:
        with pytest.raises(ComputeError, match="has no worker"):
            Cluster(dask.address, threads=1, deadline_s=3.0)  # in which a busy scheduler answers
        dask.add_workers(1)

        with closing(Cluster(dask.address, threads=1, deadline_s=3.0)) as cluster, using(cluster):  # noqa: SIM117
            with pytest.raises(WorkerLost, match="was lost"):
                run(slow_root, range(60), on_done=lambda done, total: dask.close())


@pytest.mark.parametrize("name", ["thread", "Processes", "http://127.0.0.1:8786", "tcp://127.0.0.1", "tcp://a b:1"])
def test_an_executor_that_does_not_exist_is_refused_in_a_line(name: str) -> None:
    with pytest.raises(ComputeError, match=r"DAMPER_RIG_EXECUTOR: '.*' must be") as told:
        executor_from({"DAMPER_RIG_EXECUTOR": name})
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("count", ["0", "-1", "2.5", "many", "1025", "٣", "1e2"])
def test_a_number_of_workers_that_is_none_is_refused_in_a_line(count: str) -> None:
    for name in ("serial", "threads", "processes", ""):
        with pytest.raises(ComputeError, match=r"DAMPER_RIG_WORKERS: '.*' must be a whole number") as told:
            executor_from({"DAMPER_RIG_WORKERS": count, "DAMPER_RIG_EXECUTOR": name})
        assert "\n" not in str(told.value)


def test_an_address_where_nobody_answers_is_refused_within_its_deadline() -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))  # and does not listen
        address = "tcp://{}:{}".format(*silent.getsockname())
        with pytest.raises(ComputeError, match=f"no Dask scheduler answers at '{address}'") as told:
            Cluster(address, threads=1, deadline_s=0.5)
    assert "\n" not in str(told.value)


def test_an_address_without_the_extra_is_refused_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ComputeError, match=r"'tcp://127.0.0.1:8786' needs .* 'damper-rig\[dask\]'"):
        executor_from({"DAMPER_RIG_EXECUTOR": "tcp://127.0.0.1:8786"})


def test_the_users_settings_are_what_runs() -> None:
    assert workers_from({}) == workers_from({"DAMPER_RIG_WORKERS": " "}) == available_workers() >= 1
    for name, kind in (("", Threads), ("threads", Threads), ("processes", Processes)):
        with chosen({"DAMPER_RIG_WORKERS": "5", "DAMPER_RIG_EXECUTOR": name}) as executor:
            assert (type(executor), executor.workers) == (kind, 5)
    with chosen({"DAMPER_RIG_WORKERS": "5", "DAMPER_RIG_EXECUTOR": "serial"}) as executor:
        assert executor.workers == 1


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system ties no process to a processor")
def test_a_process_tied_to_one_processor_has_one_worker() -> None:
    code = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); from identification.compute import *; "
    code += "print(available_workers())"
    said = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True)
    assert said.stdout.strip() == b"1"


@pytest.mark.slow
def test_a_search_names_the_same_with_every_number_the_same_to_the_bit(
    executors: dict[str, Executor], cluster: Executor
) -> None:
    train, held = [measured("moving_mass", k, seed=3) for k in (2, 3)], [measured("moving_mass", 5, seed=3)]

    def explained(executor: Executor) -> tuple[dict[str, Any], list[bytes]]:
        with using(executor):
            found = explain(AS_SIMULATED, train, held)
        return report_data(found), [t.final.tobytes() for t in found.traces]

    serial, *others = (explained(executor) for executor in (*executors.values(), cluster))
    assert [e["element"] for e in serial[0]["effects"]] == ["moving_mass"]
    assert serial[0]["next_test"]["design"] is not None
    for other in others:
        assert other == serial


@on(*ALL)
def test_several_starts_come_to_the_same_fit(executor: Executor) -> None:
    records = records_with("none")[:2]
    far = AS_SIMULATED.with_values(1.5 * AS_SIMULATED.values())
    with using(Serial()):
        expected = fit_from_many(far, records, 3)
    told: list[int] = []
    many = fit_from_many(far, records, 3, on_start=told.append)
    assert told == [1, 2, 3]
    assert many.costs == expected.costs
    assert many.best.model.values().tobytes() == expected.best.model.values().tobytes()


@pytest.mark.parametrize(
    ("cpu_max", "processors"),
    [
        ("100000 100000\n", 1),
        ("150000 100000\n", 1),
        ("20000 100000\n", 1),
        ("400000 100000\n", 4),
        ("max 100000\n", None),
        ("", None),
        ("100000", None),
        ("100000 0", None),
    ],
)
def test_a_container_has_as_many_workers_as_its_quota_has_whole_processors(
    cpu_max: str, processors: int | None
) -> None:
    assert processors_of_quota(cpu_max) == processors
