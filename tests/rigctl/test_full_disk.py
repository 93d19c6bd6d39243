"""A disk that fills: the space of a run is taken first; a run that is cut short all the same keeps its samples."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rigctl.disk_reserve import CLOSING_BYTES, DiskReserve, check_space, run_bytes
from rigctl.errors import RunFileError
from rigctl.runwriter import RunWriter
from tests.full_disk import a_block, a_template, cannot_mount

A_WRITE_THAT_FAILS_INSIDE_HDF5 = """
import os, sys
from pathlib import Path
from rigctl.errors import RunFileError
from rigctl.recover import recover
from rigctl.runwriter import RunWriter
from tests.full_disk import a_block, a_template, check_whole

for flush_s in (0.0, 1e9):
    for nth in (0, 1, 2, 5, 7):
        folder = Path(sys.argv[1]) / f"{flush_s}-{nth}"
        writer = RunWriter(folder / "run.h5", a_template(), expected_samples=6000, flush_interval_s=flush_s)
        said = []
        for number in range(nth + 8):
            if number == nth:
                flushed = writer._flushed_samples
                os.dup2(os.open("/dev/full", os.O_RDWR), writer._file.id.get_vfd_handle())
            for call in (lambda: writer.append(a_block(number)), lambda: writer.event(1.0, "text")):
                try:
                    call()
                except RunFileError as error:
                    said.append(str(error))
        try:
            writer.close("aborted")
        except RunFileError as error:
            said.append(str(error))
        assert len(said) <= 2, said  # then it only keeps what comes, until it is closed
        assert "recover" in said[-1], said
        check_whole(recover(writer.part), flushed, "truncated")
print("alive")
"""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_whichever_write_fails_inside_hdf5_the_process_lives_and_what_was_flushed_is_recovered(tmp_path: Path) -> None:
    done = run_python([sys.executable], A_WRITE_THAT_FAILS_INSIDE_HDF5, tmp_path)
    assert (done.returncode, done.stdout) == (0, "alive\n"), done.stderr[-2000:]


def run_python(command: list[str], script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    (folder / "script.py").write_text(script)
    root = Path(__file__).resolve().parents[2]
    return subprocess.run(
        [*command, str(folder / "script.py"), str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(root)},
    )


def test_a_run_takes_as_much_space_as_was_reckoned(tmp_path: Path) -> None:
    for samples in (1, 4000, 50_000):
        folder = tmp_path / str(samples)
        with RunWriter(folder / "run.h5", a_template(), expected_samples=samples) as writer:
            for start in range(0, samples, 1000):
                writer.append(a_block(start // 1000, min(1000, samples)))
        size = (folder / "run.h5").stat().st_size
        assert run_bytes(samples, 3) - 3 * 8 * 4096 <= size <= run_bytes(samples, 3) + 60_000 < 2 * CLOSING_BYTES + size


def test_a_reserve_has_no_name_and_gives_back_what_is_not_kept(tmp_path: Path) -> None:
    reserve = DiskReserve(tmp_path, 5_000_000)
    assert list(tmp_path.iterdir()) == []
    reserve.keep(1_000_000)
    reserve.keep(2_000_000)
    assert reserve.size == 1_000_000
    reserve.release()
    reserve.release()
    assert reserve.size == 0


def test_a_folder_that_cannot_be_written_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    check_space(tmp_path / "a" / "b", 1000, 5)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    with pytest.raises(RunFileError, match=r"^.*file: cannot be written \(.*\)$"):
        check_space(tmp_path / "file" / "runs", 1000, 5)


IN_A_SMALL_DISK = """
import os, sys
from contextlib import suppress
from pathlib import Path
import numpy as np
from rigctl.errors import RunFileError
from rigctl.player import PlayerSettings, play
from rigctl.recover import recover
from rigctl.runfile import read_run
from rigctl.runwriter import RunWriter
from sim_rig.direct import DirectTransport
from tests.full_disk import a_block, a_template, check_whole
from tests.sim_rig.conftest import Bench, a_sine

disk = Path(sys.argv[1])

class Ballast:
    def __init__(self, size):
        self.file = open(disk / ".ballast", "wb")
        if size: os.posix_fallocate(self.file.fileno(), 0, size)
    def fill(self):
        with suppress(OSError):
            while True: os.write(self.file.fileno(), bytes(4096))
    def go(self):
        self.file.close(); os.unlink(self.file.name)

def runs(name):
    (disk / name).mkdir(exist_ok=True)
    return disk / name

# the run does not fit
folder = runs("large")
with suppress(RunFileError):
    RunWriter(folder / "run.h5", a_template(), expected_samples=300_000)
    raise SystemExit("it was accepted")
assert list(folder.iterdir()) == []

# another program fills the disk at once: the run has its space
writer = RunWriter(runs("taken") / "run.h5", a_template(), expected_samples=42_000, flush_interval_s=0.0)
other = Ballast(0); other.fill()
for number in range(60): writer.append(a_block(number))
writer.close("complete")
check_whole(disk / "taken" / "run.h5", 42_000, "complete")
other.go()

# the space was not taken, the disk fills, and is full for good or only for a while
for freed in (True, False):
    for size in (0, 20_000, 80_000):
        folder = runs(f"full-{freed}-{size}")
        other = Ballast(size)
        writer = RunWriter(folder / "run.h5", a_template(), flush_interval_s=0.0 if size % 40_000 else 1e9)
        writer._reserve.release()
        other.fill()
        written, refused = 0, False
        for number in range(15):
            with suppress(RunFileError):
                writer.append(a_block(number))
            if number == 2:
                os.ftruncate(other.file.fileno(), os.fstat(other.file.fileno()).st_size - 150_000 - size)
        assert writer._full
        if freed:
            other.go()
            check_whole(writer.close("aborted"), 10_500)
        else:
            other.fill()
            flushed = writer._flushed_samples
            try:
                path = writer.close("aborted")
            except RunFileError as error:
                assert "recover" in str(error), error
                other.go()
                path = recover(writer.part)
            else:
                other.go()
            run = read_run(path)
            assert run.samples >= flushed, (run.samples, flushed)
            assert all((v == np.arange(run.samples)).all() for v in run.channels.values())
        for file in folder.iterdir(): file.unlink()

# a whole test: the rig is safe, the file is aborted
bench = Bench()
other = Ballast(0)
filled = []
def fill(progress):
    if progress.samples > 1500 and not filled:
        filled.append(other.fill())
def without_reserve(*arguments, **keys):
    writer = RunWriter(*arguments, **keys)
    writer._reserve.release()
    return writer
import rigctl.recording as recording
recording.RunWriter = without_reserve
settings = PlayerSettings(ramp_s=0.2, report_s=0.0)
try:
    play(DirectTransport(bench.rig, bench.clock), a_sine(16_000), runs("test"), settings=settings, clock=bench.clock,
         on_progress=fill)
    raise SystemExit("the disk was not full")
except RunFileError as error:
    assert "does not take sample" in str(error), error
    assert bench.rig.controller.state.name == "DISABLED"
    other.go()
    path = error.run_path or recover(next((disk / "test").glob("*.part")))
run = read_run(path)
print(run.status, run.samples)
assert run.samples > 1500
"""


@pytest.mark.slow
def test_on_a_real_full_disk_no_process_dies_and_no_sample_is_lost(tmp_path: Path) -> None:
    if reason := cannot_mount():
        pytest.skip(reason)
    (tmp_path / "disk").mkdir()
    mounted = 'mount -t tmpfs -o size=6m tmpfs "$2/disk" && exec "$0" "$1" "$2/disk"'
    done = run_python(["unshare", "-rm", "sh", "-c", mounted, sys.executable], IN_A_SMALL_DISK, tmp_path)
    assert done.returncode == 0, done.stderr[-2000:] or done.returncode
    assert done.stdout.split()[0] == "aborted", done.stdout
