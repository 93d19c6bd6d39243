"""An FMU of a linear damper, compiled here: what a supplier's simulation is to this program."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

import fmpy

from tests.conftest import missing

SOURCE = Path(__file__).parent / "damper_fmu.c"
UNITS = """<UnitDefinitions><Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
<Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit><Unit name="mA"><BaseUnit A="1" factor="0.001"/></Unit>
<Unit name="kN"><BaseUnit kg="1" m="1" s="-2" factor="1000"/></Unit></UnitDefinitions>"""
Inputs = tuple[tuple[str, str], ...]  # names and units
INPUTS: Inputs = (("stroke", "mm"), ("rate", "m/s"), ("coil", "mA"))
PARAMETERS = ("c", "c_i", "lag", "fails_at", "how")
STARTS = (650.0, 0.0, 0.0, 1e300, 0.0)


def variables(force: str, inputs: Inputs = INPUTS) -> str:
    lines = [
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="input"><Real unit="{unit}" start="0"/>'
        for k, (name, unit) in enumerate(inputs)
    ]
    lines += [
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="parameter" variability="fixed">'
        f'<Real start="{start}"/>'
        for k, (name, start) in enumerate(zip(PARAMETERS, STARTS, strict=True), start=3)
    ]
    lines.append(f'<ScalarVariable name="{force}" valueReference="8" causality="output"><Real unit="kN"/>')
    return "".join(f"{line}</ScalarVariable>" for line in lines)


def description(force: str, inputs: Inputs = INPUTS, *, back: bool = False) -> str:
    known = variables(force, inputs)
    last = len(inputs) + len(PARAMETERS) + 1
    output = f'<Outputs><Unknown index="{last}"/></Outputs><InitialUnknowns><Unknown index="{last}"/></InitialUnknowns>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="damper" guid="a damper">
<CoSimulation modelIdentifier="damper" canHandleVariableCommunicationStepSize="true"
canGetAndSetFMUstate="{str(back).lower()}"/>{UNITS}
<ModelVariables>{known}</ModelVariables><ModelStructure>{output}</ModelStructure></fmiModelDescription>"""


def packed(
    path: Path,
    library: Path,
    *,
    force: str = "axial",
    platform: str = fmpy.platform,
    inputs: Inputs = INPUTS,
    back: bool = False,
) -> Path:
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", description(force, inputs, back=back))
        extension = fmpy.sharedLibraryExtension if platform == fmpy.platform else ".dll"
        file.write(library, f"binaries/{platform}/damper{extension}")
    return path


def compiled(folder: Path, source: Path = SOURCE) -> Path:
    """Its library."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        missing("no C compiler: put gcc on the PATH")
    built = folder / f"{source.stem}.so"
    subprocess.run([str(compiler), "-shared", "-fPIC", "-O1", "-w", str(source), "-o", str(built), "-lm"], check=True)
    return built
