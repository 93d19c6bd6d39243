"""What identification raises on purpose.

IdentificationError
├── ModelError          a model that is no model: unknown element, value outside its physical range, missing parameter
│   └── ModelFileError  a model file that can't be read, written or used for what is asked of it
├── DataError           runs that can't be used for what is asked of them
├── SimulationError     the model can't run on this input
├── ConfidenceTableError  the fitted table of confidence can't be used
├── ReportFileError     a file of a report that can't be drawn from
├── OutputError         a page or a table that can't be written
└── ComputeError        there is no such executor, or nobody answers there
    └── WorkerLost      a process or a cluster ended before its tasks did

Cancelled               whoever asked for the work no longer wants it
"""


class IdentificationError(ValueError):
    """Everything that identification raises on purpose."""


class ModelError(IdentificationError):
    """A model description that is refused: what, where, the value, what would be right."""


class ModelFileError(ModelError):
    """A model file that is refused: damaged, of a kind that can't be used here, or a place that can't be written."""


class DataError(IdentificationError):
    """Runs that can't be used for what is asked of them."""


class SimulationError(IdentificationError):
    """A model that can't run on the given input."""


class ConfidenceTableError(IdentificationError):
    """A table of confidence that is damaged, or that belongs to another form tolerance."""


class ReportFileError(IdentificationError):
    """A file of a report that can't be drawn from: what, where, what would be right."""


class OutputError(IdentificationError):
    """A page or a table that can't be written."""


class ComputeError(IdentificationError):
    """An executor that does not exist or does not answer."""


class WorkerLost(ComputeError):
    """A process or a cluster that ended before its tasks did."""


class Cancelled(Exception):
    """The work was cancelled by whoever asked for it."""
