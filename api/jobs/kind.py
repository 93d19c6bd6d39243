"""A kind of job: its request, its check at submission, its work in a process, the files of its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Protocol

from api.jobs.run_choice import RunChoice

__all__ = ["Kind", "Progress", "Request", "Task"]

Progress = Callable[[float, str], None]  # share done, 0 … 1, and what is being done


class Request(RunChoice, Protocol):
    """A body of POST /v1/jobs: a frozen dataclass that is checked when it is made."""

    __dataclass_fields__: ClassVar[dict[str, Any]]  # Any: as dataclasses type it themselves

    @property
    def kind(self) -> str: ...

    @property
    def title(self) -> str: ...  # the name of the job where none is given

    @property
    def options(self) -> dict[str, Any]: ...  # JSON: stored with the ids of the runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """The input of the process of a job."""

    request: Mapping[str, Any]  # JSON: as the store keeps it
    runs: tuple[Path, ...]
    held_out: tuple[Path, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """One kind of job. ``check`` and ``run`` are called in the process of a job, never in the service."""

    name: str
    request: type[Request]
    files: Mapping[str, str]  # the names of a result's files, with their media types
    only_with: Mapping[str, str] = field(default_factory=dict)  # a file that is made only where an option asks for it
    check: Callable[[Task], None]  # raises the errors of the command line, before the job is accepted
    run: Callable[[Task, Path, Progress], dict[str, Any]]  # writes the files into a folder; returns the figures, JSON

    def files_of(self, request: Mapping[str, Any]) -> Mapping[str, str]:
        """The files that the result of a request has, with their media types. Any: JSON, as the store keeps it."""
        wanted = (name for name in self.files if name not in self.only_with or request.get(self.only_with[name]))
        return {name: self.files[name] for name in wanted}
