"""What holds of every command, found by walking the program itself."""

from __future__ import annotations

import http.server
import json
import re
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from api.cli.main import main
from tests.api.command_tree import commands, line

GROUPS = {path for path, command in commands().items() if hasattr(command, "commands")}
LISTEN = {"sim", "serve", "worker"}  # they answer by `ready` and run until they are stopped
NAMES_OF_TYPES = re.compile(
    r"<(?:list\[)?[\w ]+\]?>|\b(?:Path|NoneType|Optional|Sequence|str|int|float|bool|dict|tuple|datetime)\b|\bNone\b"
    r"|\[default: (?:\(dynamic\)|<)"
)
EVERY = pytest.mark.parametrize("path", sorted(commands()), ids=lambda path: path.replace(" ", "-") or "damper-rig")
WORKS = pytest.mark.parametrize(
    "path", sorted(set(commands()) - GROUPS - LISTEN), ids=lambda path: path.replace(" ", "-")
)


@EVERY
def test_help_names_no_python_type_and_gives_an_example(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*path.split(), "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert NAMES_OF_TYPES.findall(said) == []
    if path not in GROUPS:
        assert f"Example: damper-rig {path}" in said


@WORKS
def test_every_command_with_an_answer_gives_it_as_json_too(path: str) -> None:
    assert any("--json" in one.opts for one in commands()[path].params)


class _NothingHere(http.server.BaseHTTPRequestHandler):
    """A service that knows nothing of what it is asked: an answer at once, where silence is waited for 15 s."""

    def _refuse(self) -> None:
        self.send_error(404)

    do_GET = do_POST = do_PUT = do_PATCH = do_DELETE = _refuse

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="module")
def refusing() -> Iterator[str]:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), _NothingHere) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@WORKS
@pytest.mark.filterwarnings("error")
def test_nonsense_is_one_line_and_leaves_nothing(
    path: str, refusing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every argument and every option that is due names nothing, or what cannot be."""
    if path == "demo" or not any(one.required for one in commands()[path].params):
        return  # nothing is due: it would do its work
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DAMPER_RIG_SERVICE", refusing)
    if path in MAKE:
        return
    status = main(line(path, {}, otherwise="nothing.html"))
    said = capsys.readouterr()
    assert status in (1, 2)
    assert said.out == ""
    assert said.err.count("\n") == 1, said.err
    assert said.err.startswith("damper-rig: ")
    assert "a fault of this program" not in said.err
    assert "Traceback" not in said.err
    assert list(tmp_path.iterdir()) == []


MAKE = {"examples", "key create", "key revoke", "store backup"}  # any name is one: they make something of it


def test_what_makes_something_answers_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def told(*words: str) -> dict[str, object]:
        assert main([*words, "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert isinstance(found, dict)
        return found

    assert told("examples", str(tmp_path / "mine"))["folder"] == str(tmp_path / "mine")
    data = ("--data", str(tmp_path / "lab"))
    made = told("key", "create", "Anna Berg", "--scope", "admin", *data)
    assert made["scope"] == "admin"
    assert told("key", "revoke", str(made["id"]), *data) == {"id": made["id"], "name": "Anna Berg", "revoked": True}
