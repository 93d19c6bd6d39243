"""A damper on a sine machine, as dynos and data loggers of several makes write it; all from the same numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

RATE_HZ: Final = 500.0
SAMPLES: Final = 2000
Floats = NDArray[np.float64]

TIME: Final[Floats] = np.arange(SAMPLES) / RATE_HZ
X_M: Final[Floats] = 0.025 * np.sin(2 * np.pi * 1.5 * TIME)
V_M_S: Final[Floats] = 0.025 * 2 * np.pi * 1.5 * np.cos(2 * np.pi * 1.5 * TIME)
FORCE_N: Final[Floats] = np.where(V_M_S > 0, 3000.0, 1200.0) * V_M_S + 80.0 * np.tanh(V_M_S / 0.01)
TEMPERATURE: Final[Floats] = np.linspace(25.0, 31.0, SAMPLES)

INCH, LBF = 0.0254, 4.4482216152605


def rows(columns: Sequence[Floats], sep: str, decimal: str = ".", form: str = "{:.6f}") -> str:
    """The columns as lines of text."""
    lines = [sep.join(form.format(value) for value in row) for row in zip(*(c.tolist() for c in columns), strict=True)]
    text = "\n".join(lines) + "\n"
    return text.replace(".", decimal) if decimal != "." else text


def plain(path: Path) -> None:
    body = rows([TIME, 1e3 * X_M, FORCE_N], ",")
    path.write_text("Time (s),Displacement (mm),Force (N)\n" + body)


def german(path: Path) -> None:
    """Semicolons, decimal commas, a line of units, Windows' own encoding."""
    head = "Zeit;Kolbenweg;Dämpferkraft;Öltemperatur\ns;mm;kN;°C\n"
    body = rows([TIME, 1e3 * X_M, 1e-3 * FORCE_N, TEMPERATURE], ";", ",")
    path.write_bytes((head + body).encode("cp1252"))


def logger(path: Path) -> None:
    """Twelve lines before the names, tabs, the rate among them."""
    head = (
        "DAQ Logger\t3.1\nOperator\tA. Berg\nDate\t2026-03-01\nTime of start\t10:12:13\nSampling rate\t500 Hz\n"
        "Channels\t3\nComment\tfront left, cold\n\nCalibration\t2025-11-02\nSerial\t1234\n\n[Data]\n"
    )
    path.write_text(head + "Time [s]\tStroke [mm]\tLoad [N]\n" + rows([TIME, 1e3 * X_M, FORCE_N], "\t"))


def suffixes(path: Path) -> None:
    path.write_text("t_s,disp_mm,force_N,temp_C\n" + rows([TIME, 1e3 * X_M, FORCE_N, TEMPERATURE], ","))


def imperial(path: Path) -> None:
    body = rows([TIME, X_M / INCH, V_M_S / INCH, FORCE_N / LBF], ",", form="{:.7f}")
    path.write_text("Time (sec),Position (in),Velocity (in/s),Force (lbf)\n" + body)


def french(path: Path) -> None:
    head = "Temps (ms);Déplacement (mm);Effort (daN)\n"
    path.write_text(head + rows([1e3 * TIME, 1e3 * X_M, 0.1 * FORCE_N], ";", ","), encoding="utf-8")


def spanish(path: Path) -> None:
    head = "tiempo [s]; desplazamiento [mm]; fuerza [N]\n"
    path.write_text(head + rows([TIME, 1e3 * X_M, FORCE_N], "; "), encoding="utf-8-sig")


def italian(path: Path) -> None:
    path.write_text("Tempo, s|Corsa, mm|Forza, N\n" + rows([TIME, 1e3 * X_M, FORCE_N], "|"))


def spaces(path: Path) -> None:
    """A table of fixed width with a comment sign before the names."""
    head = "#   Time (s)   Position (mm)     Force (N)\n"
    lines = [f"{t:12.6f}  {x:14.7f}  {f:12.5f}" for t, x, f in zip(TIME, 1e3 * X_M, FORCE_N, strict=True)]
    path.write_text(head + "\n".join(lines) + "\n")


def utf16(path: Path) -> None:
    """As spreadsheets save "Unicode text"."""
    text = "Zeit [s]\tWeg [mm]\tKraft [N]\r\n" + rows([TIME, 1e3 * X_M, FORCE_N], "\t", ",").replace("\n", "\r\n")
    path.write_text(text, encoding="utf-16", newline="")


def stamped(path: Path) -> None:
    """Time stamps with a jitter of a microsecond, and each quantity in volts too."""
    noise = np.random.default_rng(4).integers(-1, 2, SAMPLES)
    stamps = np.datetime64("2026-03-01T23:59:58.5") + (np.rint(1e6 * TIME).astype(int) + noise).astype("m8[us]")
    texts = [str(stamp).replace("T", " ").ljust(26, "0") for stamp in stamps]
    body = "".join(
        f"{s},{f / 200:.9f},{f:.6f},{x * 100:.9f},{x * 1e3:.6f}\n" for s, x, f in zip(texts, X_M, FORCE_N, strict=True)
    )
    path.write_text("Timestamp,Force (V),Force (N),Displacement (V),Displacement (mm)\n" + body)


def clock_times(path: Path) -> None:
    """Times of day across midnight, with decimal commas in quotes."""
    seconds = 86398.5 + TIME
    texts = [
        f"{int(s // 3600) % 24:02d}:{int(s // 60) % 60:02d}:{s % 60:06.3f}".replace(".", ",") for s in seconds.tolist()
    ]
    body = "".join(
        f"{t};{1e3 * x:.5f};{f:.4f}\n".replace(".", ",") for t, x, f in zip(texts, X_M, FORCE_N, strict=True)
    )
    path.write_text("Uhrzeit;Weg in mm;Kraft in N\n" + body)


def command_beside(path: Path) -> None:
    """A controller's log: command and measured stroke, quotes around the names, a separator at the end of each line."""
    head = '"Running Time","Axial Command (mm)","Axial Displacement (mm)","Axial Force (kN)",\n"sec","mm","mm","kN",\n'
    body = rows([TIME, 1.01e3 * X_M, 1e3 * X_M, 1e-3 * FORCE_N], ",", form="{:.8f}").replace("\n", ",\n")
    path.write_text(head + body)


TEXT_STYLES: Final[dict[str, Callable[[Path], None]]] = {
    one.__name__: one
    for one in (
        plain, german, logger, suffixes, imperial, french, spanish, italian, spaces, utf16, stamped, clock_times,
        command_beside,
    )
}  # fmt: skip


def workbook(path: Path) -> None:
    """A sheet of notes, a sheet of results with the names in its fifth row, and a chart sheet's worth of text."""
    from openpyxl import Workbook

    book = Workbook()
    notes = book.active
    notes.title = "Notes"
    notes.append(["Test of a damper"])
    data = book.create_sheet("Test 1")
    for line in (["Shock dyno"], ["Operator", "A. Berg"], [], ["Zeit", "Hub", "Kraft"], ["s", "mm", "N"]):
        data.append(line)
    for row in zip(TIME.tolist(), (1e3 * X_M).tolist(), FORCE_N.tolist(), strict=True):
        data.append(row)
    book.save(path)


def matlab_struct(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"test": {"time_s": TIME, "stroke_mm": 1e3 * X_M, "force_N": FORCE_N, "note": "cold"}, "fs": 500.0})


def matlab_vectors(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"fs": RATE_HZ, "disp_mm": 1e3 * X_M[:, None], "load_kN": 1e-3 * FORCE_N[:, None]})


def matlab_v73(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"time_s": TIME, "stroke_mm": 1e3 * X_M, "force_N": FORCE_N}.items():
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def rpc(path: Path) -> None:
    from excitation.rpc3 import Channel, TimeHistory, write_rpc3

    channels = (
        Channel(name="Axial Displacement", unit="mm", values=1e3 * X_M),
        Channel(name="Axial Force", unit="kN", values=1e-3 * FORCE_N),
    )
    write_rpc3(path, TimeHistory(sample_rate_hz=RATE_HZ, channels=channels, drive=False))


def uff(path: Path) -> None:
    import pyuff

    pyuff.UFF(str(path)).write_sets([uff_set("Stroke", "mm", 1e3 * X_M), uff_set("Force", "N", FORCE_N)], "overwrite")


def uff_set(name: str, unit: str, values: Floats) -> dict[str, Any]:
    """A set of type 58, as pyuff writes it. Any: what a set holds."""
    words = dict.fromkeys(("rsp_ent_name", "ref_ent_name", "id2", "id3", "id4", "id5"), "NONE")
    zeros = ("ver_num", "load_case_id", "ref_node", "ref_dir", "binary", "abscissa_min", "z_axis_value")
    kinds = {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8}
    rest = {"orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0}
    labels = dict.fromkeys(("z_axis_axis_units_lab", "orddenom_axis_units_lab"), "NONE")
    return (
        words
        | dict.fromkeys(zeros, 0)
        | kinds
        | rest
        | labels
        | {
            "type": 58,
            "func_type": 1,
            "rsp_node": 1,
            "rsp_dir": 3,
            "ord_data_type": 4,
            "data": values,
            "x": TIME,
            "id1": name,
            "num_pts": SAMPLES,
            "abscissa_spacing": 1,
            "abscissa_inc": 1 / RATE_HZ,
            "abscissa_axis_units_lab": "s",
            "ordinate_axis_units_lab": unit,
        }
    )


def mdf(path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(samples=1e3 * X_M, timestamps=TIME, name="Weg", unit="mm"),
                Signal(samples=1e-3 * FORCE_N, timestamps=TIME, name="Kraft", unit="kN"),
            ]
        )
        file.append([Signal(samples=TEMPERATURE, timestamps=TIME, name="Temperatur", unit="°C")])
        file.save(path, overwrite=True)


def tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    waves = {"Stroke": ("mm", 1e3 * X_M), "Force": ("N", FORCE_N)}
    with TdmsWriter(str(path)) as file:
        file.write_segment(
            [
                ChannelObject("Test", name, values, properties={"unit_string": unit, "wf_increment": 1 / RATE_HZ})
                for name, (unit, values) in waves.items()
            ]
        )


def parquet(path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet as files

    files.write_table(pa.table({"time_s": TIME, "displacement_mm": 1e3 * X_M, "force_N": FORCE_N}), path)


BINARY_STYLES: Final[dict[str, tuple[str, Callable[[Path], None]]]] = {
    "workbook": (".xlsx", workbook),
    "MATLAB structure": (".mat", matlab_struct),
    "MATLAB vectors": (".mat", matlab_vectors),
    "MATLAB 7.3": (".mat", matlab_v73),
    "RPC III": (".rsp", rpc),
    "UFF 58": (".uff", uff),
    "MDF 4": (".mf4", mdf),
    "TDMS": (".tdms", tdms),
    "Parquet": (".parquet", parquet),
}
