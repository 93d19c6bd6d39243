"""The console script: starts the command line where the installation is whole, and else says that it is not.

It stands in a package with a name of its own and imports none of the others before they are looked at: a package of
another distribution may have the same name and lie over ours.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Final, NoReturn

__all__ = ["PACKAGES", "fault_of", "run"]

PACKAGES: Final = ("api", "damper_rig", "excitation", "identification", "rigctl", "sim_rig")
_CURE: Final = "install damper-rig into an environment of its own (README, Installation)"


def run() -> NoReturn:
    """Run the command line; ends with 1 and one line on standard error where the installation is not whole."""
    fault = fault_of(Path(__file__).resolve().parents[1])
    if fault:
        sys.exit(f"damper-rig: {fault}: {_CURE}")
    from api.cli.main import run as run_command

    run_command()


def fault_of(root: Path) -> str:
    """What is wrong with the packages that should lie in ``root``; "" where nothing is."""
    for name in PACKAGES:
        spec = find_spec(name)
        place = Path(spec.origin).resolve().parent if spec is not None and spec.origin else None
        if place is None:
            return f"the package {name!r} is missing in {root}"
        if place != root / name:
            return f"the package {name!r} in {place} is of another program, and hides that in {root}"
    changed = next(_changed(root), None)
    return "" if changed is None else f"{changed} in {root} is missing or of another program"


def _changed(root: Path) -> Iterator[str]:
    """Modules with another size than they were installed with. A working copy states no sizes."""
    for record in root.glob("damper_rig-*.dist-info/RECORD"):
        for line in record.read_text(encoding="utf-8").splitlines():
            name, _, size = line.rsplit(",", 2)
            if name.endswith(".py") and name.partition("/")[0] in PACKAGES and _size(root / name) != int(size):
                yield name


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else -1
