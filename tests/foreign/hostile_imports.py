"""Files that nobody can import: each with a word that its refusal must say."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from tests.foreign.dyno_files import BINARY_STYLES, FORCE_N, TIME, X_M, rows

HEAD: Final = "Time (s),Displacement (mm),Force (N)\n"
BODY: Final = rows([TIME[:200], 1e3 * X_M[:200], FORCE_N[:200]], ",")
Writer = Callable[[Path], object]


def text(content: str | bytes) -> Writer:
    raw = content.encode() if isinstance(content, str) else content
    return lambda path: path.write_bytes(raw)


def made(content: Callable[[], bytes]) -> Writer:
    """The same of bytes that are made only when the file is: some take a second."""
    return lambda path: path.write_bytes(content())


def with_line(number: int, line: str) -> Writer:
    """The file with one line replaced, counted from 1."""
    lines = (HEAD + BODY).splitlines()
    lines[number - 1] = line
    return text("\n".join(lines) + "\n")


def cut(style: str, share: float) -> Writer:
    """A binary file of a laboratory, cut off."""
    ending, write = BINARY_STYLES[style]

    def make(path: Path) -> None:
        whole = path.with_name(f"whole{ending}")
        write(whole)
        path.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
        whole.unlink()

    return make


def scrambled(style: str) -> Writer:
    """The same with its middle overwritten."""
    ending, write = BINARY_STYLES[style]

    def make(path: Path) -> None:
        whole = path.with_name(f"whole{ending}")
        write(whole)
        raw = bytearray(whole.read_bytes())
        whole.unlink()
        raw[len(raw) // 20 : len(raw) // 4] = b"\xa5" * (len(raw) // 4 - len(raw) // 20)
        path.write_bytes(raw)

    return make


SHEET: Final = (
    '<?xml version="1.0" encoding="UTF-8"?>{doctype}'
    '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
    "<sheetData>{rows}</sheetData></worksheet>"
)


def xlsx(sheet: bytes, *, packed: bool = True, more: dict[str, bytes] | None = None) -> bytes:
    """A workbook of one sheet, of its least parts."""
    spread, office = "http://schemas.openxmlformats.org", "application/vnd.openxmlformats-officedocument.spreadsheetml"
    relation = f'<Relationships xmlns="{spread}/package/2006/relationships"><Relationship Id="r1" Type="{spread}/'
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{spread}/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{office}.sheet.main+xml"/>'
        f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{office}.worksheet+xml"/></Types>',
        "_rels/.rels": f'{relation}officeDocument/2006/relationships/officeDocument" Target="xl/workbook.xml"/>'
        "</Relationships>",
        "xl/workbook.xml": f'<workbook xmlns="{spread}/spreadsheetml/2006/main" '
        f'xmlns:r="{spread}/officeDocument/2006/relationships"><sheets><sheet name="S" sheetId="1" r:id="r1"/></sheets>'
        "</workbook>",
        "xl/_rels/workbook.xml.rels": f'{relation}officeDocument/2006/relationships/worksheet" '
        'Target="worksheets/sheet1.xml"/></Relationships>',
    }
    packed_in = io.BytesIO()
    with zipfile.ZipFile(packed_in, "w", zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
        archive.writestr("xl/worksheets/sheet1.xml", sheet)
        for name, raw in (more or {}).items():
            archive.writestr(name, raw)
    return packed_in.getvalue()


def cells(lines: list[list[str]]) -> str:
    """Rows of cells, each a whole XML element."""
    return "".join(f"<row>{''.join(line)}</row>" for line in lines)


def said(value: str) -> str:
    return f'<c t="inlineStr"><is><t>{value}</t></is></c>'


def formulas() -> bytes:
    """Formulas whose values no program has stored."""
    head = [said(name) for name in ("Time (s)", "Displacement (mm)", "Force (N)")]
    body = [[f"<c><v>{k / 500}</v></c>", f"<c><f>SIN({k})</f></c>", f"<c><f>COS({k})</f></c>"] for k in range(50)]
    return xlsx(SHEET.format(doctype="", rows=cells([head, *body])).encode())


def entities() -> bytes:
    """An XML of some kB whose entities unfold to gigabytes."""
    lines = ['<!ENTITY a0 "1111111111">', *(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10))]
    doctype = f"<!DOCTYPE w [{''.join(lines)}]>"
    return xlsx(SHEET.format(doctype=doctype, rows=cells([["<c><v>&a9;</v></c>", "<c><v>2</v></c>"]] * 3)).encode())


@cache
def zip_bomb() -> bytes:
    return xlsx(b"<a>" + b"0" * (256 << 20))


def far_cell() -> bytes:
    """Two cells, one of which says that it is the last of a sheet."""
    rows_ = '<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'
    return xlsx(SHEET.format(doctype="", rows=rows_).encode())


def parquet_of_many_rows(path: Path) -> None:
    """Twenty million rows in some kB: equal values are packed."""
    import pyarrow as pa
    from pyarrow import parquet

    schema = pa.schema([("time_s", pa.float64()), ("displacement_mm", pa.float64()), ("force_N", pa.float64())])
    table = pa.table([pa.array(np.zeros(1 << 20))] * 3, schema=schema)
    with parquet.ParquetWriter(path, schema, compression="zstd") as file:
        for _ in range(20):
            file.write_table(table)


def mat73_with_link(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        file["time_s"], file["stroke_mm"] = TIME[None, :], X_M[None, :]
        file["force_N"] = h5py.ExternalLink("/etc/hostname", "/x")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def mat_bomb(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"time_s": np.zeros(1 << 24)}, do_compression=True)


def rpc_of_many_channels(path: Path) -> None:
    BINARY_STYLES["RPC III"][1](path)
    raw = path.read_bytes()
    path.write_bytes(
        raw.replace(b"CHANNELS".ljust(32, b"\0") + b"2\0", b"CHANNELS".ljust(32, b"\0") + b"999999999\0"[:2])
    )


HOSTILE_TEXTS: Final[dict[str, tuple[Writer, str]]] = {
    "empty": (text(""), "it is empty"),
    "only line ends": (text("\n\n\n\r\n"), "it is empty"),
    "only a BOM": (text(b"\xef\xbb\xbf"), "it is empty"),
    "only headings": (text(HEAD), "no table of numbers"),
    "one row": (text(HEAD + "0.0,1.0,2.0\n"), "1 sample"),
    "one column": (text("Force (N)\n" + "1.0\n" * 100), "two columns or more"),
    "prose": (text("The damper was cold.\nIt squeaked.\n" * 50), "no table of numbers"),
    "NaN in a cell": (with_line(50, "0.096,nan,3.0"), "line 50: displacement ('Displacement') is empty"),
    "an empty cell": (with_line(50, "0.096,,3.0"), "line 50: displacement ('Displacement') is empty"),
    "an infinite cell": (with_line(50, "0.096,1.0,inf"), "line 50: force ('Force') is infinite"),
    "text in a cell": (with_line(50, "0.096,1.0,broken"), "line 50: 'Force' is 'broken' where a number is due"),
    "text in the first row": (with_line(2, "0.0,1.0,broken"), "line 2: 'broken' where a number is due"),
    "a spreadsheet's error": (with_line(50, "0.096,#DIV/0!,3.0"), "line 50"),
    "a decimal comma in one cell": (with_line(50, '0.096,"1,5",3.0'), "line 50: 'Displacement' is '1,5'"),
    "a row too short": (with_line(50, "0.096,1.0"), "line 50: 2 columns"),
    "a row too long": (with_line(50, "0.096,1.0,2.0,3.0"), "line 50: 4 columns"),
    "headings again": (text((HEAD + BODY) * 2), "headings stand here again"),
    "a time of day among seconds": (with_line(50, "00:00:01,1.0,2.0"), "line 50"),
    "no time": (with_line(50, ",1.0,2.0"), "line 50: time"),
    "too few headings": (text("Time (s),Force (N)\n" + BODY), "2 headings and the data have 3 columns"),
    "decimal commas between commas": (text(HEAD + "0,001,1,5,2,5\n0,002,1,7,2,9\n" * 50), "3 headings"),
    "thousands separators": (text(HEAD.replace(",", ";") + "0;1.234,5;2.345,6\n" * 99), "no table of numbers"),
    "ten thousand columns": (text(4 * (",".join(["1.5"] * 10_000) + "\n")), "no displacement"),
    "thirty thousand columns": (text(4 * (",".join(["1"] * 30_000) + "\n")), "no table of numbers"),
    "one line of a megabyte": (text("1" * (1 << 20)), "no end of a line"),
    "a line of eight megabytes among others": (with_line(50, "1" * (8 << 20)), "line 50"),
    "UTF-32": (text((HEAD + BODY).encode("utf-32")), "UTF-32"),
    "binary": (text(bytes(range(256)) * 200), "binary"),
    "a picture": (text(b"\x89PNG\r\n\x1a\n" + bytes(500)), "binary"),
    "quotes that never close": (with_line(50, '"0.096,1.0,2.0'), "line"),
    "numbers beyond float64": (with_line(50, "0.096,1e999,2.0"), "line 50: displacement ('Displacement') is infinite"),
    "a wrong encoding of names": (text(HEAD.encode() + b"\xff\xfe\x00" + BODY.encode()), "binary"),
}  # fmt: skip

HOSTILE_FILES: Final[dict[str, tuple[str, Writer, str]]] = {
    "a zip that is no workbook": (".xlsx", text(b"PK\x03\x04" + bytes(100)), "not a file of XLSX"),
    "a workbook of formulas without values": (".xlsx", made(formulas), ""),
    "a zip bomb": (".xlsx", made(zip_bomb), "unpacks from"),
    "entities that unfold": (".xlsx", made(entities), "not a file of XLSX"),
    "a cell at the end of a sheet": (".xlsx", made(far_cell), ""),
    "an old workbook": (".xls", text(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500)), "save it as .xlsx"),
    "an empty workbook": (".xlsx", made(lambda: xlsx(SHEET.format(doctype="", rows="").encode())), "empty"),
    "MATLAB 7.3 with an external link": (".mat", mat73_with_link, "link"),
    "MATLAB that unpacks to far more": (".mat", mat_bomb, "unpacks to more than"),
    "Parquet of 20 million rows": (".parquet", parquet_of_many_rows, "rows"),
    "RPC III of channels that are not there": (".rsp", rpc_of_many_channels, "cut off"),
    "HDF5 of another program": (".h5", text(b"\x89HDF\r\n\x1a\n" + bytes(200)), "HDF5"),
    "UFF without a set": (".uff", text("    -1\n   151\nnothing\n    -1\n"), "no set of type 58"),
    "UFF of words": (".uff", text("    -1\n    58\nnothing\n    -1\n"), "UFF"),
    "TDMS that declares much": (".tdms", text(b"TDSm" + struct.pack("<IIQQ", 0xE, 4713, 1 << 60, 1 << 60)), "no group"),
    **{f"{style}, cut in half": (BINARY_STYLES[style][0], cut(style, 0.5), "") for style in BINARY_STYLES},
    **{f"{style}, cut to a twentieth": (BINARY_STYLES[style][0], cut(style, 0.05), "") for style in BINARY_STYLES},
    **{f"{style}, scrambled": (BINARY_STYLES[style][0], scrambled(style), "") for style in BINARY_STYLES},
}
