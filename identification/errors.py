"""What identification raises on purpose.

IdentificationError
├── ModelError          a model that is no model: unknown element, value outside its physical range, missing parameter
├── DataError           runs that can't be used for what is asked of them
├── SimulationError     the model can't run on this input
└── ComputeError        there is no such executor, or nobody answers there
    └── WorkerLost      a process or a cluster ended before its tasks did

Cancelled               whoever asked for the work no longer wants it
"""


class IdentificationError(ValueError):
    """Everything that identification raises on purpose."""


class ModelError(IdentificationError):
    """A model description that is refused: what, where, the value, what would be right."""


class DataError(IdentificationError):
    """Runs that can't be used for what is asked of them."""


class SimulationError(IdentificationError):
    """A model that can't run on the given input."""


class ComputeError(IdentificationError):
    """An executor that does not exist or does not answer."""


class WorkerLost(ComputeError):
    """A process or a cluster that ended before its tasks did."""


class Cancelled(Exception):
    """The work was cancelled by whoever asked for it."""
