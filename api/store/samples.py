"""Excitations that no design makes again: files that are stored once, by their SHA-256, and that tests name.

A plan file comes in a folder of its own, ``samples/ID``, with a lock beside it. Its excitations are written there, each
as an excitation file, before the rows in the store name them. What no row names is removed: at the end of the upload,
and after a crash at the next start.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterable, AsyncIterator, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from hashlib import file_digest, sha256
from pathlib import Path
from shutil import rmtree
from typing import Annotated, Any, ClassVar, Final
from uuid import uuid4

from pydantic import Field
from sqlalchemy import Connection, Text, cast, delete, select
from sqlalchemy.dialects import postgresql, sqlite

from api.errors import InputError, StoreError
from api.processes.plan_content import channels_of
from api.processes.run_reader import PlanContent, RunReader
from api.store.clock import now
from api.store.database import Database
from api.store.disk_space import storage_errors
from api.store.part_file import PartFile, PartMark, part_files
from api.store.receiving import Receiving
from api.store.tables import campaigns, designs, samples, tests
from excitation.atomic import sync_directory, sync_file
from excitation.configuration import STRICT, to_spec
from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.files import read_excitation
from excitation.hdf5 import hdf5_bytes
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = [
    "KIND",
    "Excitations",
    "PlanUpload",
    "SampleStore",
    "SamplesSpec",
    "hold_samples",
    "names_of_samples",
    "plays_samples",
]

KIND: Final = "samples"  # of a test
# Of all files of samples of one campaign, which are in memory while it is checked: four files of the largest size.
MOST_TOGETHER_BYTES: Final = 256 << 20
_FOLDER: Final = "samples"
_OPEN_CAMPAIGNS: Final = ("accepted", "running")
_AGAIN: Final = "upload it again (POST /v1/designs/file)"


@dataclass(frozen=True, kw_only=True)
class SamplesSpec:
    """Set-points of an uploaded file, played as they are; POST /v1/designs/file stores them and says their SHA-256."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]  # of the stored file


class SampleStore:
    """Files below the folder of run files, rows in the database. Safe to use from many threads and services."""

    def __init__(self, database: Database, root: Path, receiving: Receiving, reader: RunReader) -> None:
        self._database, self._root, self._receiving, self._reader = database, root, receiving, reader

    @asynccontextmanager
    async def receive(self, name: str, content: AsyncIterable[bytes], *, length: int = 0) -> AsyncIterator[PlanUpload]:
        """An uploaded plan or excitation file, read in a process of its own, with its samples on the disk.

        They are removed at the end of the block, but those that ``keep`` has stored.

        Raises TooLarge, TooSlow, DiskFull, Busy, InputError where the body is empty, and ExcitationFileError with the
        message of the reader.
        """
        with storage_errors():
            await asyncio.to_thread(self._receiving.space.check, length)
            folder = self._root / _FOLDER / uuid4().hex
            mark = await asyncio.to_thread(PartMark, folder)
            try:
                with self._receiving.turn(name, length):
                    found = await self._read(folder / "upload", name, content)
                    written = await asyncio.to_thread(self._written, folder, name, found)
                yield written
            finally:
                await asyncio.to_thread(self._end, folder, mark)

    def excitations(self) -> Excitations:
        """Makes the excitations of the tests of one campaign."""
        return Excitations(self)

    def excitation(self, digest: str) -> Excitation:
        """The samples with this SHA-256; raises DesignError, one line, where they are missing or were changed."""
        short = f"samples {digest[:12]}…"
        with self._database.reading() as connection:
            location = connection.scalar(select(samples.c.location).where(samples.c.sha256 == digest))
        if location is None:
            raise DesignError(f"{short} are not stored here: upload their file (POST /v1/designs/file)")
        try:
            if _digest(self._root / location) != digest:
                raise DesignError(f"{short}: their file was changed: {_AGAIN}")
            return read_excitation(self._root / location)
        except FileNotFoundError as error:
            raise DesignError(f"{short}: their file is missing: {_AGAIN}") from error
        except OSError as error:
            raise DesignError(f"{short}: their file cannot be read ({error.strerror}): {_AGAIN}") from error

    def size_bytes(self, digest: str) -> int:
        """The size of a file; 0 where there is none."""
        with self._database.reading() as connection:
            found = connection.scalar(select(samples.c.size_bytes).where(samples.c.sha256 == digest))
        return int(found or 0)

    def hold(self, configs: Sequence[Mapping[str, Any] | None]) -> None:
        """As `hold_samples`, in the transaction of this thread. Any: JSON."""
        with self._database.writing() as connection:
            hold_samples(connection, configs)

    def remove_unused(self, digests: Iterable[str] | None = None) -> None:
        """Remove those of some samples, or of all, that no design and no open campaign names."""
        query = select(samples.c.sha256, samples.c.location).order_by(samples.c.sha256)
        if digests is not None:
            query = query.where(samples.c.sha256.in_(list(digests)))
        with self._database.writing() as connection:
            rows = connection.execute(query.with_for_update()).all()  # first: who names them later waits, then fails
            used = _used(connection) if rows else frozenset()
            unused = [row for row in rows if row.sha256 not in used]
            connection.execute(delete(samples).where(samples.c.sha256.in_([row.sha256 for row in unused])))
        for row in unused:
            path = self._root / row.location
            path.unlink(missing_ok=True)
            with suppress(OSError):  # others of its plan are there
                path.parent.rmdir()

    def put_right(self) -> None:
        """Remove what a crash has left and what nothing names any more, except what another service is receiving."""
        self.remove_unused()
        place = self._root / _FOLDER
        dead = part_files(place, "*")
        live = {mark.stem for mark in place.glob("*.part") if mark not in dead}
        for folder in sorted(place.glob("*/")):
            if folder.name not in live:
                self._tidy(folder)
        for mark in dead:
            mark.unlink(missing_ok=True)

    async def _read(self, folder: Path, name: str, content: AsyncIterable[bytes]) -> PlanContent:
        part = await asyncio.to_thread(PartFile, folder, name)
        try:
            await self._receiving.write(part, name, content)
            if not part.size:
                raise InputError("the body is empty: send the content of an excitation or plan file")
            await asyncio.to_thread(part.name_it)  # the reader goes by its ending
            return await self._reader.read_plan(part.final, name)
        finally:
            part.discard()
            await asyncio.to_thread(rmtree, folder, ignore_errors=True)

    def _written(self, folder: Path, name: str, found: PlanContent) -> PlanUpload:
        self._receiving.space.check(sum(values.nbytes for one in found.excitations for values in channels_of(one)))
        digests: list[str] = []
        files: dict[str, _File] = {}
        known: dict[str, Excitation] = {}
        for number, excitation in enumerate(found.excitations):
            content = hdf5_bytes(excitation)
            digest = sha256(content).hexdigest()
            digests.append(digest)
            if digest in files:
                continue
            path = folder / f"{number}.h5"
            path.write_bytes(content)
            sync_file(path)
            known[digest] = _read_back(path, name)
            location = path.relative_to(self._root).as_posix()
            files[digest] = _File(location=location, size_bytes=len(content), is_new=not self._has(digest))
        if files:
            sync_directory(folder)
            sync_directory(folder.parent)
        return PlanUpload(
            tests=[_with_digest(test, digests) for test in found.tests],
            warm_up=None if found.warm_up is None else _with_digest(found.warm_up, digests),
            make=Excitations(self, known),
            _files=files,
            _database=self._database,
            _receiving=self._receiving,
        )

    def _has(self, digest: str) -> bool:
        """Whether samples are stored, with a file that is whole."""
        try:
            self.excitation(digest)
        except ExcitationError:
            return False
        return True

    def _end(self, folder: Path, mark: PartMark) -> None:
        with suppress(StoreError):  # then the next start does it
            self._tidy(folder)
            mark.end(keep=True)

    def _tidy(self, folder: Path) -> None:
        """Remove what no row names."""
        here = samples.c.location.startswith(f"{_FOLDER}/{folder.name}/", autoescape=True)
        with self._database.reading() as connection:
            kept = set(connection.scalars(select(samples.c.location).where(here)))
        for path in sorted(folder.rglob("*"), reverse=True):  # what is in a folder, before it
            with suppress(OSError):
                if path.is_dir():
                    path.rmdir()
                elif path.relative_to(self._root).as_posix() not in kept:
                    path.unlink()
        with suppress(OSError):
            folder.rmdir()


class Excitations:
    """Makes excitations from the keys of a test: of samples from their file, which is read once, of others as designed.

    One for each campaign, in one thread.
    """

    def __init__(self, store: SampleStore, known: Mapping[str, Excitation] | None = None) -> None:
        self._store, self._known, self._bytes = store, dict(known or {}), 0

    def __call__(self, config: Mapping[str, JSON], where: str) -> Excitation:
        """Raises DesignError, one line that begins with ``where``."""
        if not plays_samples(config):
            return excitation_from_config(config, where)
        try:
            spec = to_spec(SamplesSpec, {key: value for key, value in config.items() if key != "kind"})
        except DesignError as error:
            raise error.below(where) from error
        try:
            return self._of(spec.sha256)
        except DesignError as error:
            raise error.below(where, "sha256") from error

    def _of(self, digest: str) -> Excitation:
        if digest not in self._known:
            self._bytes += self._store.size_bytes(digest)
            if self._bytes > MOST_TOGETHER_BYTES:
                raise DesignError(f"the samples of its tests take more than {MOST_TOGETHER_BYTES} bytes: divide them")
            self._known[digest] = self._store.excitation(digest)
        return self._known[digest]


@dataclass(frozen=True, slots=True, kw_only=True)
class _File:
    """A file of an upload; ``is_new``: the store has no whole file of these samples."""

    location: str
    size_bytes: int
    is_new: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanUpload:
    """The tests of an uploaded file as configurations, which nobody has checked yet. Any: JSON."""

    tests: list[dict[str, Any]]
    warm_up: dict[str, Any] | None
    make: Excitations
    _files: Mapping[str, _File] = field(repr=False)
    _database: Database = field(repr=False)
    _receiving: Receiving = field(repr=False)

    def keep(self) -> None:
        """Store the samples in the transaction of this thread, which also stores what names them. Raises DiskFull."""
        if not self._files:
            return
        with self._database.writing() as connection:
            self._receiving.check_total(connection, sum(one.size_bytes for one in self._files.values() if one.is_new))
            for digest, file in sorted(self._files.items()):  # in one order: two services never wait for each other
                _put(connection, digest, file)


def names_of_samples(configs: Iterable[Mapping[str, Any] | None]) -> list[str]:
    """The SHA-256 of all samples that tests name, each once. Any: JSON."""
    found = (one.get("sha256") for one in configs if one is not None and plays_samples(one))
    return sorted({digest for digest in found if isinstance(digest, str)})


def plays_samples(config: Mapping[str, Any]) -> bool:
    """Whether a test plays stored samples. Any: JSON."""
    return bool(config.get("kind") == KIND)


def hold_samples(connection: Connection, configs: Sequence[Mapping[str, Any] | None]) -> None:
    """Let nobody remove the samples of tests before this transaction ends. Raises InputError where some are not stored.

    Any: JSON.
    """
    digests = names_of_samples(configs)
    if not digests:
        return
    query = select(samples.c.sha256).where(samples.c.sha256.in_(digests)).order_by(samples.c.sha256)
    held = set(connection.scalars(query.with_for_update(read=True)))
    for digest in digests:
        if digest not in held:
            raise InputError(f"samples {digest[:12]}… are no longer stored: {_AGAIN}")


def _put(connection: Connection, digest: str, file: _File) -> None:
    """Insert a row, or lock the one that is there."""
    insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    row = insert(samples).values(sha256=digest, location=file.location, size_bytes=file.size_bytes, created_at_s=now())
    location = row.excluded.location if file.is_new else samples.c.location
    connection.execute(row.on_conflict_do_update(index_elements=[samples.c.sha256], set_={"location": location}))


def _used(connection: Connection) -> frozenset[str]:
    """The SHA-256 of all samples that a design or an open campaign names."""
    is_open = campaigns.c.state.in_(_OPEN_CAMPAIGNS)
    found: list[Mapping[str, Any] | None] = []  # Any: JSON
    for query in (
        select(tests.c.config).join(campaigns).where(is_open, cast(tests.c.config, Text).contains("sha256")),
        select(campaigns.c.warm_up).where(is_open, cast(campaigns.c.warm_up, Text).contains("sha256")),
        select(designs.c.warm_up).where(cast(designs.c.warm_up, Text).contains("sha256")),
    ):
        found += connection.scalars(query)
    for of_design in connection.scalars(select(designs.c.tests).where(cast(designs.c.tests, Text).contains("sha256"))):
        found += of_design
    return frozenset(names_of_samples(found))


def _with_digest(test: Mapping[str, Any], digests: Sequence[str]) -> dict[str, Any]:
    """The configuration of a test, with the SHA-256 of its samples for their number. Any: JSON."""
    number = test.get("excitation")
    if "kind" in test or type(number) is not int or not 0 <= number < len(digests):
        return dict(test)
    rest = {key: value for key, value in test.items() if key not in ("name", "excitation")}
    return {"name": test.get("name"), "kind": KIND, "sha256": digests[number], **rest}


def _read_back(path: Path, name: str) -> Excitation:
    """What a rig will play; raises ExcitationFileError where an excitation does not keep to the limits of a file."""
    try:
        return read_excitation(path)
    except ExcitationError as error:
        raise ExcitationFileError(str(error).replace(str(path), name)) from error


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
