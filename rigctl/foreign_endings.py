"""How the names of measured files of other programs end, known without loading their readers."""

from __future__ import annotations

from typing import Final

__all__ = ["BINARY", "ENDINGS", "TEXT", "WORKBOOKS"]

TEXT: Final = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn")
WORKBOOKS: Final = (".xlsx", ".xlsm")
_RECORDERS: Final = (".mat", ".rsp", ".drv", ".rpc", ".tim", ".uff", ".unv", ".ufb", ".mf4", ".mdf", ".tdms")
BINARY: Final = (*_RECORDERS, ".parquet", ".pq")
ENDINGS: Final = (*TEXT, *WORKBOOKS, *BINARY)
