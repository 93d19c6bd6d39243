"""Who imports whom, what reaches a user's site-packages, and what no test may do."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder
from importlinter.cli import lint_imports

ROOT = Path(__file__).parent.parent
PACKAGES = ("api", "damper_rig", "damper_rig_start", "excitation", "identification", "rigctl", "sim_rig")


def test_every_import_keeps_to_the_rules() -> None:
    before = Path.cwd()
    os.chdir(ROOT)
    try:
        assert lint_imports(cache_dir=None) == 0
    finally:
        os.chdir(before)


def test_the_wheel_holds_the_seven_packages_and_nothing_else() -> None:
    files = [file.distribution_path for file in WheelBuilder(str(ROOT)).recurse_included_files()]
    assert {path.split("/")[0] for path in files} == set(PACKAGES)
    assert not [path for path in files if "test_" in path or "/tests/" in path]
    for due in (
        *(f"{package}/py.typed" for package in PACKAGES),
        "api/store/migrations/versions/0001_campaigns.py",
        "api/store/migrations/versions/0006_jobs.py",
        "api/store/migrations/script.py.mako",
        "api/web/live.html",
        "api/web/static/live.js",
        "api/demo/data/mr_utfpr/NOTICE.md",
        "api/demo/data/mr_utfpr/ensaio_A_1.h5",
        "api/demo/data/viscous.json",
        "identification/discrepancy/confidence.json",
    ):
        assert due in files, due


def test_the_distribution_cannot_be_uploaded_by_accident() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "Private :: Do Not Upload" in project["classifiers"]
    assert list(project["scripts"]) == ["damper-rig"]


def test_help_loads_none_of_the_heavy_libraries() -> None:
    heavy = ("numpy", "numba", "scipy", "h5py", "fastapi", "sqlalchemy", "pydantic", "plotly")
    code = f"import sys, api.cli.main; print([m for m in {heavy} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert said.stdout.strip() == "[]"


def test_a_notebook_loads_no_service_and_no_library_that_it_does_not_use() -> None:
    absent = ("api", "fastapi", "sqlalchemy", "pandas", "xarray", "IPython", "scipy.signal", "scipy.stats")
    code = f"import sys, damper_rig; print([m for m in {absent} if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert said.stdout.strip() == "[]"


def test_a_service_and_a_worker_start_without_the_libraries_of_the_work_of_jobs() -> None:
    code = "import sys, api.app, api.campaigns.worker; "
    code += "print({m.split('.')[0] for m in sys.modules} & {'scipy', 'numba', 'plotly'})"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert said.stdout.strip() == "set()"


def test_the_process_of_an_fmu_loads_no_model_before_it_begins() -> None:
    code = "import sys, identification.fmu_process.live_process, identification.fmu_process.simulate; "
    code += "print({'numba', 'scipy', 'identification.models'} & sys.modules.keys())"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert said.stdout.strip() == "set()"


def test_every_package_says_what_it_exports() -> None:
    for package in PACKAGES:
        text = (ROOT / package / "__init__.py").read_text()
        assert text.startswith('"""'), package
        assert "def " not in text, f"{package}/__init__.py only re-exports"
        assert "class " not in text.split('"""')[2], f"{package}/__init__.py only re-exports"


TESTS = sorted((ROOT / "tests").rglob("*.py"))


def modules_imported(tree: ast.Module) -> Iterator[str]:
    """Full names, and of `from a import b` also `a.b`: b may be a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
            yield from (f"{node.module or ''}.{name.name}" for name in node.names)


def names_replaced(tree: ast.Module) -> Iterator[str]:
    """Every name that a test gives to `setattr`, `delattr` or `patch`, in whole or as the end of a dotted path."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if called in ("setattr", "delattr", "patch", "object"):
            texts = [a.value for a in node.args[:2] if isinstance(a, ast.Constant) and isinstance(a.value, str)]
            yield from (part for text in texts for part in text.split("."))


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def test_no_test_module_imports_another() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {module}"
        for path in TESTS
        for module in modules_imported(ast.parse(path.read_text(encoding="utf-8")))
        if module.split(".")[0] == "tests" and any(part.startswith("test_") for part in module.split("."))
    ]
    assert not found, "move what they share into a module whose name does not begin with test_"


def test_no_test_replaces_a_private_name() -> None:
    found = {
        (path.name, name)
        for path in TESTS
        for name in names_replaced(ast.parse(path.read_text(encoding="utf-8")))
        if is_private(name)
    }
    assert not found, "give the function an argument for it instead"


@pytest.mark.parametrize(
    ("line", "private"),
    [
        ('monkeypatch.setattr(module, "_limit", 3)', True),
        ('monkeypatch.setattr("package.module._Class.run", None)', True),
        ('patch.object(module, "_limit")', True),
        ('monkeypatch.setattr(module, "LIMIT", 3)', False),
        ('setattr(module, "__doc__", "")', False),
    ],
)
def test_a_private_name_that_is_replaced_is_found(line: str, private: bool) -> None:
    assert any(map(is_private, names_replaced(ast.parse(line)))) == private


def test_no_function_of_the_physical_models_takes_more_than_eight_arguments() -> None:
    trees = {
        path: ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "identification/physical").rglob("*.py")
    }
    counts = {
        f"{path.name}: {node.name}": len(node.args.args) + len(node.args.kwonlyargs)
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
    }
    assert {name: count for name, count in counts.items() if count > 8} == {}
