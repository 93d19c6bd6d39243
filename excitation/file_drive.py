"""An excitation file as a test of a plan: its samples stay where they are and are read when they are played."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_within
from excitation.configuration import STRICT, to_config
from excitation.errors import DesignError, ExcitationError
from excitation.kinds import FILE
from excitation.record_digest import check_digest, digest_of
from excitation.signal import Excitation, made_on_demand

__all__ = ["FileSpec", "file_drive"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FileSpec:
    """The samples of an excitation file as they are, the displacement times ``level``.

    ``record_sha256`` is filled in when the file is read: the design is made again from the same file only.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    record: str
    level: float = 1.0
    record_sha256: str = ""

    def __post_init__(self) -> None:
        check_within("level", self.level, 1e-6, 1e3)


def file_drive(spec: FileSpec) -> Excitation:
    """The excitation of the file, which it reads again whenever samples are read.

    Raises DesignError where the file cannot be read or has changed since the design.
    """
    read = _read(spec)
    spec = replace(spec, record_sha256=spec.record_sha256 or digest_of(Path(spec.record)))
    return made_on_demand(
        kind=read.kind,
        sample_rate_hz=read.sample_rate_hz,
        period_samples=read.period_samples,
        samples=read.samples,
        displacement_m=partial(_displacement, spec),
        current_a=None if read.current_a is None else partial(_current, spec),
        design={"kind": FILE, **to_config(spec)},
        figures=read.figures,
        checked=True,
    )


def _read(spec: FileSpec) -> Excitation:
    from excitation.files import read_excitation  # which reads files of designs, and so needs this module

    path = Path(spec.record)
    if path.is_file() and spec.record_sha256:
        check_digest(path, spec.record_sha256)
    try:
        return read_excitation(path)
    except DesignError:
        raise
    except ExcitationError as error:
        raise DesignError(f"record {error}") from error


def _displacement(spec: FileSpec) -> NDArray[np.float64]:
    x = _read(spec).displacement_m
    return x if spec.level == 1.0 else spec.level * x


def _current(spec: FileSpec) -> NDArray[np.float64]:
    current = _read(spec).current_a
    assert current is not None  # the file is the same, by its digest
    return current
