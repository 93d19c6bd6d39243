"""An upload is read in a process of its own, refused in one line where it is hostile, and leaves no part behind."""

from __future__ import annotations

import asyncio
import os
import resource
import signal
import socket
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from api.app import create_app
from api.errors import Busy, DiskFull, InputError, TooSlow
from api.jobs.process import check_in_process
from api.processes.run_reader import RunReader
from api.settings import Settings
from api.store.database import Database
from api.store.runs import RunStore
from rigctl.errors import RunFileError
from rigctl.runfile import write_run
from tests.api.measured import a_run
from tests.api.serving import serving
from tests.hostile_files import HOSTILE, UNUSUAL
from tests.starting import Started

WITHIN_S = 90.0


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lab") / "data"


@pytest.fixture(scope="module")
def client(data: Path) -> Iterator[httpx.Client]:
    with serving(create_app(Settings(data_dir=data), with_workers=False)) as client:
        client.timeout = httpx.Timeout(WITHIN_S)
        yield client


@pytest.fixture
def good(tmp_path: Path) -> Path:
    write_run(tmp_path / "good.h5", a_run(1, 2.0))
    return tmp_path / "good.h5"


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with Database(f"sqlite:///{tmp_path / 'store.db'}") as opened:
        yield opened


def files_below(folder: Path) -> list[Path]:
    """Those that are there while it looks: a folder may go meanwhile."""
    return [Path(where) / name for where, _, names in os.walk(folder) for name in names]


async def pieces(content: bytes, wait_s: float = 0.0) -> AsyncIterator[bytes]:
    yield content[:1000]
    await asyncio.sleep(wait_s)
    yield content[1000:]


EVERY_THIRD = [  # a process reads each: what it refuses of all of them is in test_hostile_run_files.py
    pytest.param(kind, marks=[pytest.mark.bench] if k % 3 else []) for k, kind in enumerate(HOSTILE)
]


@pytest.mark.parametrize("kind", EVERY_THIRD)
def test_a_hostile_upload_is_refused_in_one_line(kind: str, client: httpx.Client, data: Path, tmp_path: Path) -> None:
    write, expected = HOSTILE[kind]
    write(tmp_path / "bad.h5")
    before = files_below(data / "runs")
    answer = client.post("/v1/runs", params={"name": "bad.h5"}, content=(tmp_path / "bad.h5").read_bytes())
    assert answer.status_code == 422, answer.text
    assert expected in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]
    assert str(data) not in answer.text
    assert files_below(data / "runs") == before


RANDOM = np.random.default_rng(20261128).bytes(1 << 16)


@pytest.mark.parametrize(
    "content", [b"", b"HDF5", RANDOM, b"{" + RANDOM], ids=["empty", "text", "random", "random behind a brace"]
)
def test_what_is_no_run_file_is_refused(content: bytes, client: httpx.Client) -> None:
    answer = client.post("/v1/runs", params={"name": "bad.h5"}, content=content)
    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("bad.h5: damaged or not an HDF5 file")


def test_an_unusual_upload_that_keeps_to_the_layout_is_kept(client: httpx.Client, tmp_path: Path) -> None:
    UNUSUAL["of the latest format"](tmp_path / "good.h5")
    answer = client.post("/v1/runs", params={"name": "good.h5"}, content=(tmp_path / "good.h5").read_bytes())
    assert answer.status_code == 201, answer.text
    assert (answer.json()["specimen"], answer.json()["samples"]) == ("s", 64)


def test_an_upload_that_ends_early_leaves_no_file(client: httpx.Client, data: Path, good: Path) -> None:
    before = files_below(data / "runs")
    address = urlsplit(str(client.base_url))
    with socket.create_connection((address.hostname, address.port)) as connection:
        head = f"POST /v1/runs?name=a.h5 HTTP/1.1\r\nHost: {address.netloc}\r\nContent-Length: 1000000\r\n\r\n"
        connection.sendall(head.encode() + good.read_bytes()[:5000])
        wait_for(lambda: len(files_below(data / "runs")) > len(before))
    wait_for(lambda: files_below(data / "runs") == before)


def wait_for(condition: object) -> None:
    ends = time.monotonic() + WITHIN_S
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < ends
        time.sleep(0.01)


def test_what_kill_9_leaves_of_an_upload_is_removed_at_the_start(tmp_path: Path, good: Path) -> None:
    uploads = tmp_path / "lab" / "runs" / "uploads"
    with Started(["serve", "--data", str(tmp_path / "lab"), "--port", "0"], tmp_path / "serve.log") as child:
        address = urlsplit(child.wait_until_ready())
        with socket.create_connection((address.hostname, address.port)) as connection:
            head = f"POST /v1/runs?name=a.h5 HTTP/1.1\r\nHost: {address.netloc}\r\nContent-Length: 1000000\r\n\r\n"
            connection.sendall(head.encode() + good.read_bytes()[:5000])
            wait_for(lambda: files_below(uploads))
            child.kill()
    assert [path.name for path in files_below(uploads)] == ["a.h5.part"]
    with serving(create_app(Settings(data_dir=tmp_path / "lab"), with_workers=False)):
        assert list(uploads.iterdir()) == []


def test_an_upload_that_the_store_has_noted_gets_its_name_after_a_crash(database: Database, good: Path) -> None:
    runs = RunStore(database, good.parent / "runs")
    kept = asyncio.run(runs.receive("front.h5", pieces(good.read_bytes())))
    [path] = runs.paths([kept.id])
    path.rename(f"{path}.part")  # as it is between the row and the name
    assert runs.put_uploads_right() == 1
    assert runs.paths([kept.id]) == (path,)


def test_an_upload_that_another_service_receives_is_left_alone(database: Database, good: Path) -> None:
    runs = RunStore(database, good.parent / "runs")

    async def content() -> AsyncIterator[bytes]:
        yield good.read_bytes()
        assert RunStore(database, good.parent / "runs").put_uploads_right() == 0

    kept = asyncio.run(runs.receive("front.h5", content()))
    assert runs.paths([kept.id])[0].read_bytes() == good.read_bytes()


def test_below_the_watermark_nothing_is_written_and_no_test_begins(tmp_path: Path, good: Path) -> None:
    settings = Settings(data_dir=tmp_path / "lab", least_free_bytes=1 << 60)
    with serving(create_app(settings, with_workers=False)) as client:
        answer = client.post("/v1/runs", params={"name": "a.h5"}, content=good.read_bytes())
    assert answer.status_code == 507
    assert "GB must stay free" in answer.json()["detail"]
    assert not (tmp_path / "lab" / "runs").exists()
    with Database(settings.store_url) as database:
        runs = RunStore(database, tmp_path, least_free_bytes=1 << 60)
        with pytest.raises(DiskFull, match="must stay free"):
            runs.check_room()
        RunStore(database, tmp_path, least_free_bytes=0).check_room()


def test_all_uploads_together_have_a_quota(database: Database, good: Path) -> None:
    size = good.stat().st_size
    runs = RunStore(database, good.parent / "runs", least_free_bytes=0, most_upload_bytes_total=2 * size)
    for _ in range(2):
        asyncio.run(runs.receive("front.h5", pieces(good.read_bytes())))
    with pytest.raises(DiskFull, match="most_upload_bytes_total"):
        asyncio.run(runs.receive("front.h5", pieces(good.read_bytes())))
    assert len(files_below(good.parent / "runs")) == 2


def test_without_descriptors_an_upload_is_refused_and_may_come_again(database: Database, good: Path) -> None:
    runs = RunStore(database, good.parent / "runs", least_free_bytes=0)
    before, content = resource.getrlimit(resource.RLIMIT_NOFILE), good.read_bytes()

    async def attempt() -> None:
        await asyncio.to_thread(lambda: None)  # the thread exists
        await asyncio.to_thread(runs.put_uploads_right)  # a connection of it to the store
        used = [os.open(os.devnull, os.O_RDONLY)]
        resource.setrlimit(resource.RLIMIT_NOFILE, (used[0] + 1, before[1]))
        try:
            with pytest.raises(Busy, match="too many files open"):
                await runs.receive("front.h5", pieces(content))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)
            os.close(used[0])

    asyncio.run(attempt())
    assert files_below(good.parent / "runs") == []
    assert asyncio.run(runs.receive("front.h5", pieces(good.read_bytes()))).samples == 4000


def test_a_file_that_is_not_read_in_time_is_refused(good: Path) -> None:
    with pytest.raises(RunFileError, match=r"front\.h5: damaged: it was not read within 0 s"):
        asyncio.run(RunReader(deadline_s=0.0).read(good, "front.h5"))


def test_a_file_that_waited_for_the_processor_may_come_again(good: Path) -> None:
    with pytest.raises(Busy, match=r"front\.h5: it was not read within 3 s, the computer") as late, Stopped("read_run"):
        asyncio.run(RunReader(deadline_s=3.0).read(good, "front.h5"))
    assert late.value.retry_after_s > 0


def test_a_job_whose_check_waited_for_the_processor_may_come_again_and_a_slow_one_is_refused(good: Path) -> None:
    task = ("characterise", {"kind": "characterise"}, [good], [])
    with pytest.raises(Busy, match="1 runs: not read within 3 s, the computer") as late, Stopped("api.jobs"):
        check_in_process(*task, within_s=3.0)
    assert late.value.retry_after_s > 0
    with pytest.raises(InputError, match="1 runs: not read within 0 s: give fewer"):
        check_in_process(*task, within_s=0.0)


class Stopped:
    """Stops every process of a module that this process starts, as a computer does that has no time for them."""

    def __init__(self, module: str) -> None:
        self._module, self._before, self._end = module.encode(), children(module.encode()), Event()
        self._thread = Thread(target=self._stop)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *error: object) -> None:
        self._end.set()
        self._thread.join()

    def _stop(self) -> None:
        while not self._end.wait(0.005):
            for pid in children(self._module) - self._before:
                with suppress(ProcessLookupError):  # it ended since
                    os.kill(pid, signal.SIGSTOP)


def children(module: bytes) -> set[int]:
    """The processes of a module that this process has started, and has not waited for."""
    found = set()
    for task in Path("/proc/self/task").iterdir():
        with suppress(OSError):
            for pid in map(int, (task / "children").read_text().split()):
                with suppress(OSError):
                    if module in Path(f"/proc/{pid}/cmdline").read_bytes():
                        found.add(pid)
    return found


def test_beyond_its_queue_the_reader_says_when_to_come_again(good: Path) -> None:
    async def three() -> list[object]:
        reader = RunReader(at_once=1, waiting=1)
        return list(await asyncio.gather(*(reader.read(good, "a.h5") for _ in range(3)), return_exceptions=True))

    busy = [one for one in asyncio.run(three()) if isinstance(one, Busy)]
    assert len(busy) == 1
    assert busy[0].retry_after_s > 0


def test_a_crash_of_the_reading_process_is_a_refusal(good: Path) -> None:
    async def crash() -> None:
        reader = RunReader()
        await reader.read(good, "a.h5")  # starts a spare
        spare = reading_process()
        os.kill(spare, signal.SIGSTOP)
        reading = asyncio.create_task(reader.read(good, "a.h5"))
        while reading_process() == spare:  # until the spare one is taken, and another one waits in its place
            await asyncio.sleep(0)
        os.kill(spare, signal.SIGSEGV)
        os.kill(spare, signal.SIGCONT)
        with pytest.raises(RunFileError, match="SIGSEGV"):
            await reading
        assert (await reader.read(good, "a.h5")).samples == 4000

    asyncio.run(crash())


def reading_process() -> int:
    """The one that was started last: services of other tests have spare ones too, and numbers of processes wrap."""
    return max(children(b"read_run_file"), key=started)


def started(pid: int) -> int:
    """When a process was started, in ticks since the host was."""
    return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[19])


def test_a_body_that_does_not_come_is_given_up(database: Database, good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("api.store.receiving.PIECE_S", 0.05)
    with pytest.raises(TooSlow, match="nothing came"):
        asyncio.run(RunStore(database, good.parent / "runs").receive("a.h5", pieces(good.read_bytes(), 60.0)))
    assert files_below(good.parent / "runs") == []
