"""A MATLAB file whose arrays declare more than it holds is refused before a reader makes room for them."""

from __future__ import annotations

import struct
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from excitation.errors import ExcitationFileError
from excitation.untrusted import check_mat

HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
CELL, STRUCT, CHAR, DOUBLE, SPARSE = 1, 2, 4, 6, 5
FIELD = struct.pack("<HHi", 5, 4, 8) + struct.pack("<II", 1, 8) + b"field".ljust(8, b"\0")


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def matrix(kind: int, dimensions: tuple[int, ...], content: bytes = b"", name: bytes = b"x") -> bytes:
    declared = struct.pack(f"<{len(dimensions)}i", *dimensions)
    head = element(6, struct.pack("<II", kind, 0)) + element(5, declared) + element(1, name)
    return element(14, head + content)


ABSURD = {
    "cells": matrix(CELL, (100_000, 100_000)),
    "cells in a cell": matrix(CELL, (1, 1), matrix(CELL, (1 << 30, 4), name=b"")),
    "negative": matrix(CELL, (-(1 << 31), -4)),
    "structures": matrix(STRUCT, (1 << 28, 1), FIELD),
    "a field of a structure": matrix(STRUCT, (1, 1), FIELD + matrix(CELL, (1 << 28, 1), name=b"")),
    "texts": matrix(CHAR, (1 << 20, 1 << 10)),
    "numbers": matrix(DOUBLE, (1 << 28, 8), element(9, bytes(64))),
    "columns of a sparse table": matrix(SPARSE, (1, 1 << 30), element(5, bytes(8)) * 3),
    "32 dimensions": matrix(CELL, (100,) * 32),
    "a longest name": matrix(CELL, (1, 1), struct.pack("<II", 14, 1 << 30)),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", [kind for kind in ABSURD if kind != "a longest name"])
def test_dimensions_that_the_file_cannot_hold_are_refused_in_one_line(kind: str, packed: bool, tmp_path: Path) -> None:
    path, content = tmp_path / "absurd.mat", ABSURD[kind]
    if packed:
        squeezed = zlib.compress(content)
        content = struct.pack("<II", 15, len(squeezed)) + squeezed
    path.write_bytes(HEADER + content)
    with pytest.raises(
        ExcitationFileError, match=r"absurd\.mat: an array declares .* bytes: no run or design"
    ) as refused:
        check_mat(path)
    assert "\n" not in str(refused.value)


def test_cells_in_cells_without_end_are_refused(tmp_path: Path) -> None:
    inner = b""
    for _ in range(30):
        inner = matrix(CELL, (1, 1), inner)
    (tmp_path / "deep.mat").write_bytes(HEADER + inner)
    with pytest.raises(ExcitationFileError, match="cells in cells, more than"):
        check_mat(tmp_path / "deep.mat")


def test_what_is_cut_short_or_is_no_matrix_is_left_to_the_reader(tmp_path: Path) -> None:
    path = tmp_path / "cut.mat"
    for whole in (*ABSURD.values(), matrix(CELL, (1, 1), matrix(DOUBLE, (1, 1), element(9, bytes(8))))):
        for size in range(0, min(len(whole), 80), 3):
            path.write_bytes(HEADER + whole[:size])
            with suppress(ExcitationFileError):  # and nothing else
                check_mat(path)


@pytest.mark.parametrize("packed", [False, True])
def test_files_that_hold_what_they_declare_pass(packed: bool, tmp_path: Path) -> None:
    cells = np.empty((2, 3), dtype=object)
    cells[:] = [["a", 1.0, np.arange(5.0)], ["", np.zeros((0, 3)), {"nested": [1, 2, 3]}]]
    content = {
        "run": {"force": np.zeros(5000), "name": "front", "empty": "", "flag": True, "units": ["N", "m"]},
        "cells": cells,
        "none": np.empty((0, 0), dtype=object),
        "small": np.uint8([1, 2, 3]),
        "long text": "x" * 3000,
    }
    content["long_text"] = content.pop("long text")
    savemat(tmp_path / "good.mat", content, do_compression=packed)
    check_mat(tmp_path / "good.mat")
