"""damper-rig in a notebook or a script: `import damper_rig as dr`. The functions are those of the command line."""

from damper_rig import study
from damper_rig.analysing import Analysed, analyse
from damper_rig.catalogue import Elements, elements
from damper_rig.comparing import Compared, compare
from damper_rig.designing import DesignWarning, design
from damper_rig.explaining import Explained, explain
from damper_rig.fitting import Fitted, fit
from damper_rig.identifying import Identified, identify
from damper_rig.loading import DataWarning, load
from damper_rig.plots import plot
from damper_rig.runs import Runs
from damper_rig.saving import save
from damper_rig.scoring import Scored, score
from damper_rig.sheets import Sheet, characterise
from damper_rig.simulating import load_model, simulate
from damper_rig.tables import from_pandas, from_xarray, to_pandas, to_xarray
from excitation import Envelope, Excitation, TestPlan
from identification.models import Choice as FmuChoice
from rigctl.foreign_files import Choice
from rigctl.runfile import Run

__all__ = [
    "Analysed",
    "Choice",
    "Compared",
    "DataWarning",
    "DesignWarning",
    "Elements",
    "Envelope",
    "Excitation",
    "Explained",
    "Fitted",
    "FmuChoice",
    "Identified",
    "Run",
    "Runs",
    "Scored",
    "Sheet",
    "TestPlan",
    "analyse",
    "characterise",
    "compare",
    "design",
    "elements",
    "explain",
    "fit",
    "from_pandas",
    "from_xarray",
    "identify",
    "load",
    "load_model",
    "plot",
    "save",
    "score",
    "simulate",
    "study",
    "to_pandas",
    "to_xarray",
]
