"""Many that watch the live samples of a service, in a process of their own.

python -m benchmarks.service_watchers URL NUMBER SECONDS
"""

from __future__ import annotations

import asyncio
import json
import sys
from urllib.parse import urlsplit


async def watch(url: str, number: int, seconds: float) -> dict[str, float]:
    """How many were still watching at the end, and what all of them were sent."""
    parts = urlsplit(url)
    watching = size = 0

    async def one() -> None:
        nonlocal watching, size
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        writer.write(f"GET /v1/live HTTP/1.1\r\nhost: {parts.netloc}\r\n\r\n".encode())
        assert b" 200 " in await reader.readline()
        try:
            async with asyncio.timeout(seconds):
                while part := await reader.read(65536):
                    size += len(part)
        except TimeoutError:
            watching += 1
        writer.close()

    await asyncio.gather(*(one() for _ in range(number)))
    return {"watching": watching, "megabytes": size / 1e6}


if __name__ == "__main__":
    print(json.dumps(asyncio.run(watch(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))))
