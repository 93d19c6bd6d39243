"""The files for a deployment name only what exists, and the documented settings are those of the code."""

from __future__ import annotations

import ast
import configparser
import inspect
import json
import logging
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from api.access.logs import JsonLines
from api.settings import PREFIX, Settings, as_toml, read_settings

ROOT = Path(__file__).parent.parent.parent
DEPLOY = ROOT / "deploy"
UNITS = sorted((DEPLOY / "systemd").glob("*.service"))
FILES = [path for path in sorted(DEPLOY.rglob("*")) if path.is_file()]
NOT_SETTINGS = {"DAMPER_RIG_CONFIG", "DAMPER_RIG_RIG"}  # the second is of the compose file itself


def unit(path: Path) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # keys of systemd have capitals
    parser.read(path, encoding="utf-8")
    return parser


def commands() -> Iterator[list[str]]:
    for path in UNITS:
        yield unit(path)["Service"]["ExecStart"].split()[1:]
    for service in yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"].values():
        if service.get("image", "") == "damper-rig":
            yield service["command"]


def test_every_command_in_the_files_exists() -> None:
    named = [words[0] for words in commands()]
    assert sorted(set(named)) == ["serve", "worker"]
    for name in set(named):
        said = subprocess.run([sys.executable, "-m", "api.cli", name, "--help"], capture_output=True, check=False)
        assert said.returncode == 0, name


def test_every_setting_in_the_files_exists() -> None:
    known = {PREFIX + field.name.upper() for field in fields(Settings)} | NOT_SETTINGS
    for path in FILES:
        named = set(re.findall(r"DAMPER_RIG_[A-Z_]*[A-Z]", path.read_text(encoding="utf-8")))
        assert named <= known, path


def test_the_example_of_settings_can_be_read() -> None:
    settings = read_settings({}, DEPLOY / "damper-rig.toml")
    assert (settings.access, settings.host, settings.log_format) == ("keys", "127.0.0.1", "json")


def test_the_settings_of_the_compose_file_can_be_used() -> None:
    compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    environ = compose["services"]["service"]["environment"]
    plain = {name: re.sub(r"\$\{\w+:[-?]([^}]*)\}", r"\1", value) for name, value in environ.items()}
    assert read_settings(plain).access == "keys"
    assert compose["services"]["service"]["ports"] == ["127.0.0.1:8420:8420"]  # not open to the network
    assert (DEPLOY / ".." / compose["x-damper-rig"]["build"]["dockerfile"]).is_file()


@pytest.mark.parametrize("path", UNITS, ids=lambda path: path.name)
def test_a_unit_is_hardened_and_gives_the_rig_time_to_come_to_rest(path: Path) -> None:
    service = unit(path)["Service"]
    assert {
        key: service[key] for key in ("NoNewPrivileges", "ProtectSystem", "PrivateTmp", "CapabilityBoundingSet")
    } == {
        "NoNewPrivileges": "true",
        "ProtectSystem": "strict",
        "PrivateTmp": "true",
        "CapabilityBoundingSet": "",
    }
    assert service["MemoryMax"]
    assert service["Restart"] == "on-failure"
    assert float(service["TimeoutStopSec"]) > 2 * Settings().stop_s
    assert service["User"] != "root"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze on this machine")
def test_systemd_finds_no_fault_in_the_units(tmp_path: Path) -> None:
    for path in UNITS:
        text = path.read_text(encoding="utf-8").replace("/opt/damper-rig/bin/damper-rig", sys.executable)
        (tmp_path / path.name).write_text(text, encoding="utf-8")
    found = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", *(str(tmp_path / path.name) for path in UNITS)],
        capture_output=True,
        text=True,
        check=False,
    )
    ours = [line for line in found.stderr.splitlines() if "damper-rig" in line]
    assert ours == []


def test_what_the_container_copies_is_there_and_is_the_whole_program() -> None:
    copied = {
        source
        for line in (DEPLOY / "Containerfile").read_text().splitlines()
        if line.startswith("COPY ") and "--from" not in line
        for source in line.split()[1:-1]
    }
    assert all((ROOT / source).exists() for source in copied)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    packages = set(project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"])
    assert packages | {"pyproject.toml", "README.md", "LICENSE"} <= copied
    assert not {".", "tests", ".venv", ".git"} & copied


def documented() -> str:
    """The table of settings as the code has it: name, default, and the comment beside it."""
    source = inspect.getsource(Settings)
    defaults = dict(line.split(" = ", 1) for line in as_toml(Settings()).splitlines())
    lines = source.splitlines()
    rows = ["| setting | default | what it is |", "|---|---|---|"]
    for node in ast.parse(source).body[0].body:  # type: ignore[attr-defined]  # the body of the class
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.end_lineno is not None:
            text = " ".join(lines[node.lineno - 1 : node.end_lineno])
            comment = text.partition("  # ")[2].strip().removesuffix(")").strip()
            rows.append(f"| `{node.target.id}` | `{defaults[node.target.id]}` | {comment} |")
    return "\n".join(rows)


def test_the_documented_settings_are_those_of_the_code() -> None:
    table = documented()
    assert all(f"`{field.name}`" in table for field in fields(Settings))
    assert table in (ROOT / "docs" / "service.md").read_text(encoding="utf-8"), f"docs/service.md needs:\n{table}"


def test_a_line_of_the_json_log_is_one_object_whatever_is_in_it() -> None:
    try:
        raise ValueError("two\nlines")
    except ValueError:
        record = logging.LogRecord("damper_rig", logging.ERROR, "x.py", 1, 'a "%s"\n', ("ü",), sys.exc_info())
    line = JsonLines().format(record)
    event = json.loads(line)
    assert "\n" not in line
    assert (event["level"], event["logger"], event["message"]) == ("error", "damper_rig", 'a "ü"\n')
    assert event["time"].endswith("+00:00")
    assert "two\nlines" in event["traceback"]
