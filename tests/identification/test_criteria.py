"""The numbers that decide names and verdicts are few, stand in one place, and each says where it comes from."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import astuple, fields
from pathlib import Path

import pytest

import identification
from identification import criteria
from identification.criteria import BUDGET, CHANCE, FORM, TEXT

ROOT = Path(identification.__file__).parent
GROUPS = {"CHANCE": CHANCE, "FORM": FORM, "BUDGET": BUDGET, "TEXT": TEXT}
JUDGING = [
    *(ROOT / "discrepancy" / f"{name}.py" for name in (
        "candidates", "checks", "evidence", "excess", "holdout", "naming", "rivals", "search", "signatures", "strength",
        "trials", "verdict",
    )),
    ROOT / "fitting" / "refine.py",
]  # fmt: skip
PLAIN = {0.0, 0.5, 1.0, 2.0, 1e-300}  # signs, halves, squares, and a divisor that is never zero


def numbers(group: object) -> Iterator[float]:
    for value in astuple(group):  # type: ignore[call-overload]  # a dataclass
        yield from value if isinstance(value, tuple) else (value,)


def test_no_more_than_thirty_numbers_decide_names_and_verdicts() -> None:
    assert sum(1 for group in (CHANCE, FORM) for _ in numbers(group)) <= 30
    assert sum(1 for _ in numbers(BUDGET)) <= 17


@pytest.mark.parametrize("name", GROUPS)
def test_every_number_is_in_use(name: str) -> None:
    source = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.rglob("*.py"))
    unused = [f.name for f in fields(GROUPS[name]) if f"{name}.{f.name}" not in source]  # type: ignore[arg-type]
    assert not unused


def test_every_number_that_decides_says_what_it_is() -> None:
    tree = ast.parse(Path(criteria.__file__).read_text(encoding="utf-8"))
    silent = []
    for group in (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name != "Text"):
        for own, after in zip(group.body, [*group.body[1:], ast.Pass()], strict=True):
            if isinstance(own, ast.AnnAssign) and not isinstance(after, ast.Expr):
                silent.append(ast.unparse(own.target))
    assert not silent


@pytest.mark.parametrize("path", JUDGING, ids=lambda path: path.stem)
def test_a_module_that_judges_holds_no_number_of_its_own(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    held = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, float)}
    assert held <= PLAIN
