"""Run files that come from elsewhere over HTTP: streamed to the disk, read whole, and kept only where they are good."""

from __future__ import annotations

import re
from collections.abc import AsyncIterable
from hashlib import sha256
from pathlib import Path
from uuid import uuid4

from fastapi.concurrency import run_in_threadpool

from api.campaigns.records import Upload
from api.errors import InputError, TooLarge
from api.store.runs import RunFiles
from rigctl.errors import RunFileError
from rigctl.runfile import read_run

__all__ = ["received"]

MOST_BYTES = 512 * 2**20
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}\.h5")


async def received(files: RunFiles, name: str, content: AsyncIterable[bytes]) -> Upload:
    """Keep a run file that is being sent.

    Raises InputError for its name, TooLarge, and RunFileError in the words that every reader of run files uses.
    """
    if not _NAME.fullmatch(name):
        raise InputError(f"name is {name!a:.60}: a run file is called like front-left_3.h5, of letters, digits, . _ -")
    upload_id = uuid4().hex
    folder = files.work_dir("uploads") / upload_id
    path = folder / name
    await run_in_threadpool(folder.mkdir, parents=True)
    try:
        size, digest = await _written(path, content)
        return await run_in_threadpool(_upload, files, path, upload_id, size, digest)
    except BaseException:
        path.unlink(missing_ok=True)
        folder.rmdir()
        raise


async def _written(path: Path, content: AsyncIterable[bytes]) -> tuple[int, str]:
    size, digest = 0, sha256()
    with path.open("wb") as file:
        async for part in content:
            size += len(part)
            if size > MOST_BYTES:
                raise TooLarge(f"{path.name} is larger than {MOST_BYTES} bytes: cut the run into several")
            digest.update(part)
            await run_in_threadpool(file.write, part)
    return size, digest.hexdigest()


def _upload(files: RunFiles, path: Path, upload_id: str, size: int, digest: str) -> Upload:
    try:
        run = read_run(path)
    except RunFileError as error:
        raise RunFileError(str(error).replace(f"{path.parent}/", "")) from error
    return Upload(
        id=upload_id,
        name=path.name,
        location=path.relative_to(files.root).as_posix(),
        size_bytes=size,
        sha256=digest,
        specimen=run.specimen,
        status=run.status,
        samples=run.samples,
        sample_rate_hz=run.sample_rate_hz,
    )
