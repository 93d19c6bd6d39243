"""The client repeats only what is safe, says what failed in one line, and brings whole files or none."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from api.client import Campaign, Client, RunFile, Service, Test, find_service
from api.client.connection import Connection, Repeat
from api.client.download import file_name
from api.errors import InputError, NotFound, ServiceError
from tests.api.cutting import cutting, told

KEY = "dr_0123456789abcdef"


class Clock:
    """Time that passes only where somebody sleeps."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.slept: list[float] = []

    def now(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now_s += seconds


def connection(url: str, clock: Clock) -> Connection:
    return Connection(Service(url=url), now=clock.now, sleep=clock.sleep)


@pytest.mark.parametrize(
    ("statuses", "repeat", "asked"),
    [
        ([503, 0, 200], Repeat.ALWAYS, 3),
        ([0], Repeat.IF_NOT_DONE, 1),
        ([503], Repeat.IF_NOT_DONE, 1),
        ([429, 429, 200], Repeat.IF_NOT_DONE, 3),
    ],
)
def test_a_request_is_repeated_only_where_that_is_safe(statuses: list[int], repeat: Repeat, asked: int) -> None:
    clock = Clock()
    with told(statuses, b'{"detail": "not now"}') as service:
        wire = connection(service.url, clock)
        if statuses[-1] == 200:
            assert wire.json("POST", "/v1/x", repeat=repeat) == {"detail": "not now"}
        else:
            with pytest.raises(ServiceError):
                wire.json("POST", "/v1/x", repeat=repeat)
        wire.close()
    assert service.asked == ["POST /v1/x"] * asked
    assert len(clock.slept) == asked - 1


def test_a_service_that_is_not_there_is_asked_again_for_a_while_and_then_named() -> None:
    clock = Clock()
    wire = connection("http://127.0.0.1:9", clock)
    with pytest.raises(ServiceError, match=r"^http://127\.0\.0\.1:9 did not answer GET /v1/rigs: .+$"):
        wire.json("GET", "/v1/rigs", repeat=Repeat.IF_NOT_DONE)
    wire.close()
    assert 10.0 < clock.now_s < 15.0
    assert clock.slept == sorted(clock.slept)


def test_a_refusal_is_one_line_with_every_error(base: str) -> None:
    with Client(Service(url=base)) as client:
        with pytest.raises(NotFound, match=r"there is no campaign 'x'"):
            client.campaign("x")
        with pytest.raises(InputError) as caught:
            client.submit({"name": "n", "rig": "modbus://127.0.0.1:5020", "specimen": "s", "tests": []})
        assert "tests" in str(caught.value)
        assert "\n" not in str(caught.value)
    problem = {"detail": "2 errors", "errors": [{"detail": "level is 7:\nat most 1"}, {"detail": "seed is missing"}]}
    with told([503], json.dumps(problem).encode()) as service:
        wire = connection(service.url, Clock())
        with pytest.raises(ServiceError, match=r": 2 errors; level is 7: at most 1; seed is missing$"):
            wire.json("POST", "/v1/x", repeat=Repeat.IF_NOT_DONE)
        wire.close()


def test_an_answer_of_another_program_is_named() -> None:
    for body, words in ((b"<html>", "not JSON"), (b'{"rigs": [{"url": 7}]}', "cannot read")):
        with told([200], body) as service, Client(Service(url=service.url)) as client:
            answer = client.rigs
            with pytest.raises(ServiceError, match=words):
                answer()


def test_the_key_travels_as_a_bearer_token_and_is_in_no_text_of_the_client() -> None:
    with told([200], b'{"rigs": []}') as service:
        named = Service(url=service.url, key=KEY)
        with Client(named) as client:
            assert client.rigs() == ()
    assert f"authorization: bearer {KEY}" in service.headers[0].lower()
    assert KEY not in repr(named)


def test_service_and_key_come_from_the_argument_the_environment_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text(f"{KEY}\n")
    file.chmod(0o600)
    assert find_service({}) == Service()
    environ = {"DAMPER_RIG_SERVICE": "https://rig.example/", "DAMPER_RIG_KEY": KEY}
    assert find_service(environ) == Service(url="https://rig.example", key=KEY)
    assert find_service(environ, url="https://other.example").url == "https://other.example"
    assert find_service({"DAMPER_RIG_KEY_FILE": str(file)}).key == KEY
    assert find_service({"DAMPER_RIG_KEY": "other"}, key_file=file).key == KEY
    file.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        find_service({}, key_file=file)


@pytest.mark.parametrize(
    ("url", "key", "words"),
    [
        ("http://rig.example", KEY, "https://"),
        ("ftp://rig.example", "", "http://"),
        ("https://me:secret@rig.example", "", "password"),
        ("https://", "", "host"),
        ("https://rig.example", "two words", "characters"),
    ],
)
def test_a_service_that_cannot_be_is_refused(url: str, key: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        Service(url=url, key=key)
    assert "secret" not in str(caught.value)
    assert KEY not in str(caught.value)


def a_test(state: str, samples: int) -> Test:
    return Test(
        name="t", kind="sine", held_out=False, state=state, phase="", samples=samples, total_samples=100, duration_s=10
    )


def a_campaign(*tests: Test, state: str = "running") -> Campaign:
    texts = dict.fromkeys(("id", "name", "rig", "specimen", "reason", "asked", "question", "created"), "")
    return Campaign(number=1, state=state, started=None, ended=None, tests=tests, **texts)


def test_the_time_left_is_the_rig_time_of_what_is_not_played() -> None:
    now = a_campaign(a_test("done", 100), a_test("running", 25), a_test("waiting", 0))
    assert (now.rig_time_s, now.left_s) == (30.0, 17.5)
    assert a_campaign(a_test("skipped", 0), a_test("aborted", 20), state="aborted").left_s == 0.0


@pytest.fixture(scope="module")
def kept(base: str, folder: Path) -> Callable[[Path], RunFile]:
    """A file that the service gives out with ranges, told as if it were a run."""
    import hashlib

    import httpx

    path = "/static/plotly.min.js"
    content = httpx.get(base + path, timeout=60).content

    def told_of(to: Path) -> RunFile:
        sha256 = hashlib.sha256(content).hexdigest()
        return RunFile(
            id="r", test="slow", held_out=False, status="complete", samples=1, sample_rate_hz=1.0,
            size_bytes=len(content), sha256=sha256, file=path,
        )  # fmt: skip

    return told_of


def test_a_download_that_breaks_goes_on_where_it_ended(
    base: str, kept: Callable[[Path], RunFile], tmp_path: Path
) -> None:
    run, shares = kept(tmp_path), [0.0]
    assert run.size_bytes > 6000
    with cutting(base, after=3000, times=2) as url, Client(Service(url=url)) as client:
        to = client.fetch(run, tmp_path, tell=shares.append)
    assert to.read_bytes().__len__() == run.size_bytes
    assert shares == sorted(shares)  # it never began again
    assert [path.name for path in tmp_path.iterdir()] == ["slow.h5"]
    with Client(Service(url="http://127.0.0.1:9")) as nobody:
        assert nobody.fetch(run, tmp_path) == to  # what is there already is not asked for


def test_a_download_that_stays_broken_keeps_its_part_for_the_next_command(
    base: str, kept: Callable[[Path], RunFile], tmp_path: Path
) -> None:
    run = kept(tmp_path)
    with cutting(base, after=600, times=99) as url, Client(Service(url=url)) as client, pytest.raises(ServiceError):
        client.fetch(run, tmp_path)
    [part] = tmp_path.iterdir()
    assert part.name.endswith(".part")
    shares: list[float] = []
    with Client(Service(url=base)) as client:
        client.fetch(run, tmp_path, tell=shares.append)
    assert [path.name for path in tmp_path.iterdir()] == ["slow.h5"]


def test_content_that_is_not_as_recorded_is_not_kept(
    base: str, kept: Callable[[Path], RunFile], tmp_path: Path
) -> None:
    run = replace(kept(tmp_path), sha256="0" * 64)
    with Client(Service(url=base)) as client:
        with pytest.raises(ServiceError, match="not what the service recorded"):
            client.fetch(run, tmp_path)
        assert not list(tmp_path.iterdir())
        (tmp_path / "slow.h5").write_text("mine")
        with pytest.raises(InputError, match="another file"):
            client.fetch(run, tmp_path)
    assert (tmp_path / "slow.h5").read_text() == "mine"


@pytest.mark.parametrize("test", ["../../etc/passwd", "a/b", "..", "", "sine 1 Hz, held out", "x" * 10, "C:\\x"])
def test_the_name_of_a_test_never_leads_out_of_the_folder(test: str, kept: Callable[[Path], RunFile]) -> None:
    name = file_name(replace(kept(Path()), test=test))
    assert Path(name).name == name
    assert name.endswith(".h5")
    assert not name.startswith(".")
