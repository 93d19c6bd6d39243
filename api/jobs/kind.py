"""What a kind of job consists of: a request, a check at submission, the work in a process, the files of a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

from api.jobs.run_choice import RunChoice

__all__ = ["Kind", "Progress", "Request", "Task"]

Progress = Callable[[float, str], None]  # share done, 0 … 1, and what is being done


class Request(RunChoice, Protocol):
    """A body of POST /v1/jobs: a frozen dataclass that refuses to exist when it is wrong."""

    __dataclass_fields__: ClassVar[dict[str, Any]]  # Any: as dataclasses type it themselves

    @property
    def kind(self) -> str: ...

    @property
    def title(self) -> str: ...  # what the job is called where no name is given

    @property
    def options(self) -> dict[str, Any]: ...  # JSON: what the store keeps of it beside the ids of the runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What the process of a job is given."""

    request: Mapping[str, Any]  # JSON: as the store keeps it
    runs: tuple[Path, ...]
    held_out: tuple[Path, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """One kind of job. ``check`` and ``run`` are called in the process of a job, never in the service."""

    name: str
    request: type[Request]
    files: Mapping[str, str]  # the names of a result's files, with their media types
    check: Callable[[Task], None]  # raises what the command line would refuse, before the job is accepted
    run: Callable[[Task, Path, Progress], dict[str, Any]]  # writes the files into a folder; returns the figures, JSON
