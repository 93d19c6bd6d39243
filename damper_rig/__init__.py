"""damper-rig in a notebook or a script: `import damper_rig as dr`. The functions are those of the command line."""

from damper_rig.catalogue import Elements, elements
from damper_rig.comparing import Compared, compare
from damper_rig.designing import design
from damper_rig.explaining import Explained, explain
from damper_rig.fitting import Fitted, fit
from damper_rig.loading import DataWarning, load
from damper_rig.plots import plot
from damper_rig.runs import Runs
from damper_rig.saving import save
from damper_rig.sheets import Sheet, characterise
from damper_rig.simulating import load_model, simulate
from damper_rig.tables import from_pandas, from_xarray, to_pandas, to_xarray
from excitation import Envelope, Excitation, TestPlan
from identification.models import Choice as FmuChoice
from rigctl.foreign_files import Choice
from rigctl.runfile import Run

__all__ = [
    "Choice",
    "Compared",
    "DataWarning",
    "Elements",
    "Envelope",
    "Excitation",
    "Explained",
    "Fitted",
    "FmuChoice",
    "Run",
    "Runs",
    "Sheet",
    "TestPlan",
    "characterise",
    "compare",
    "design",
    "elements",
    "explain",
    "fit",
    "from_pandas",
    "from_xarray",
    "load",
    "load_model",
    "plot",
    "save",
    "simulate",
    "to_pandas",
    "to_xarray",
]
