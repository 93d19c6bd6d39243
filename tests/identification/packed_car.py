"""A quarter car as an FMU, compiled here: what a user's own vehicle is to this program."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy

from tests.identification.packed_fmu import compiled

SOURCE = Path(__file__).parent / "car_fmu.c"
_UNITS = """<UnitDefinitions><Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit><Unit name="m"><BaseUnit m="1"/>
</Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit><Unit name="m/s2"><BaseUnit m="1" s="-2"/></Unit>
<Unit name="kN"><BaseUnit kg="1" m="1" s="-2" factor="1000"/></Unit></UnitDefinitions>"""
_INPUTS = (("z_road", "m"), ("v_road", "m/s"), ("F", "kN"))
_OUTPUTS = (("s", "mm"), ("s_dot", "m/s"), ("a_body", "m/s2"), ("body", "m"))
WIRING = """
output = ["a_body", "body"]
[[damper]]
name = "suspension"
extension = "s"
rate = "s_dot"
force = "F"
[[ground]]
displacement = "z_road"
velocity = "v_road"
"""


def packed_car(folder: Path, *, back: bool = True) -> Path:
    """The FMU; with `back` it says that it can save its state."""
    inputs = "".join(
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="input"><Real unit="{unit}" start="0"/>'
        "</ScalarVariable>"
        for k, (name, unit) in enumerate(_INPUTS)
    )
    outputs = "".join(
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="output"><Real unit="{unit}"/></ScalarVariable>'
        for k, (name, unit) in enumerate(_OUTPUTS, start=3)
    )
    known = "".join(f'<Unknown index="{k}"/>' for k in range(4, 8))
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="car" guid="a car">
<CoSimulation modelIdentifier="car" canHandleVariableCommunicationStepSize="true"
canGetAndSetFMUstate="{str(back).lower()}"/>{_UNITS}<ModelVariables>{inputs}{outputs}
<ScalarVariable name="m_body" valueReference="7" causality="parameter" variability="fixed"><Real start="300"/>
</ScalarVariable></ModelVariables><ModelStructure><Outputs>{known}</Outputs><InitialUnknowns>{known}</InitialUnknowns>
</ModelStructure></fmiModelDescription>"""
    path = folder / ("car.fmu" if back else "car-forth.fmu")
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", text)
        file.write(compiled(folder, SOURCE), f"binaries/{fmpy.platform}/car{fmpy.sharedLibraryExtension}")
    return path
