"""What a rig does by its own registers, seen over a connection of its own that only reads.

    python -m benchmarks.service_kills.watcher URL FILE

One line for each look: seconds since 1970, whether the rig has power, displacement in m.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from api.processes.parent import end_with_parent
from rigctl.address import connect
from rigctl.axis import UNPOWERED
from rigctl.errors import TransportError

__all__ = ["Motions"]

LOOK_S = 0.02  # a motion shorter than this is not seen; powering up alone takes longer
AWAY_S = 0.1


def main(url: str, file: str) -> None:
    """Look until the process is ended, or its standard input closes."""
    end_with_parent()
    with Path(file).open("a", encoding="utf-8", buffering=1) as out:
        while True:
            try:
                wire = connect(url)
                try:
                    wire.identify(1.0)
                    while True:
                        status = wire.status(1.0)
                        powered = int(status.state not in UNPOWERED)
                        out.write(f"{time.time():.4f} {powered} {status.displacement_m:.6f}\n")
                        time.sleep(LOOK_S)
                finally:
                    wire.close()
            except TransportError:
                out.write(f"{time.time():.4f} - -\n")
                time.sleep(AWAY_S)


@dataclass(slots=True)
class Motions:
    """The moments at which a rig came under power, and at which it was last seen under power."""

    file: Path
    begins: list[float] = field(default_factory=list)
    looks: int = 0
    last_powered_at: float = 0.0
    powered: bool = False
    _read: int = 0

    def update(self) -> None:
        """Read what has been seen since the last time."""
        with self.file.open(encoding="utf-8") as lines:
            lines.seek(self._read)
            text = lines.read()
        whole = text[: text.rfind("\n") + 1]
        self._read += len(whole.encode())
        for line in whole.splitlines():
            at, powered, _ = line.split()
            if powered == "-":  # a rig that does not answer; one that is started again begins without power
                continue
            self.looks += 1
            if powered == "1":
                if not self.powered:
                    self.begins.append(float(at))
                self.last_powered_at = float(at)
            self.powered = powered == "1"

    def between(self, start: float, end: float) -> int:
        """How many motions began between two moments."""
        self.update()
        return sum(start < at < end for at in self.begins)


if __name__ == "__main__":
    main(*sys.argv[1:])
