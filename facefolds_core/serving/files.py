"""What the player's server gives out: the player's own files, an asset's manifest and what that names. Nothing else."""

from __future__ import annotations

import asyncio
import json
import mimetypes
import os
import re
import stat
from io import FileIO
from pathlib import Path

from aiohttp import web

MANIFEST = "manifest.json"
LARGEST_MANIFEST = 1 << 24
"""Bytes. A manifest is a few kB a level."""
CHUNK = 1 << 18
WRITE_PATIENCE = 30.0
"""Seconds that a client may take for one chunk: one that reads nothing does not hold a file for ever."""
PACKED_TYPES = (".html", ".js", ".css", ".json", ".wasm", ".svg")
"""Meshes, videos and pictures are packed already."""

_PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,254}")
_RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})")
_TYPES = {
    ".js": "application/javascript",
    ".wasm": "application/wasm",
    ".webm": "video/webm",
    ".mp4": "video/mp4",
    ".m4a": "audio/mp4",
    ".mpd": "application/dash+xml",
    ".m3u8": "application/vnd.apple.mpegurl",
}
"""Of what the machine's own table may have otherwise: browsers refuse modules and wasm of another type."""


def asset_file(folder: Path, name: str) -> FileIO | None:
    """Open the manifest of an asset, or a file that it names; None for anything else."""
    if name != MANIFEST and (not _PLAIN_NAME.fullmatch(name) or name not in named_files(folder)):
        return None
    return open_inside(folder, name)


def player_file(folder: Path, name: str) -> FileIO | None:
    """Open a file of the built player, in `folder` or below; None for anything else."""
    if not all(_PLAIN_NAME.fullmatch(part) for part in name.split("/")):
        return None
    return open_inside(folder, name)


def named_files(folder: Path) -> set[str]:
    """What a manifest names. Read leniently: the player says what is wrong with a manifest, not the server."""
    file = open_inside(folder, MANIFEST)
    if file is None:
        return set()
    with file:
        raw = file.read(LARGEST_MANIFEST + 1)
    try:
        waiting = [json.loads(raw)] if len(raw) <= LARGEST_MANIFEST else []
    except (ValueError, RecursionError):
        return set()
    found = set()
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            found |= {name for key in ("file", "mesh", "video") if isinstance(name := value.get(key), str)}
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
    return found


def open_inside(folder: Path, name: str) -> FileIO | None:
    """Open a regular file in `folder` or below; None if missing, special, not readable, or led out by a link."""
    try:
        path = (folder / name).resolve(strict=True)
        if not path.is_relative_to(folder.resolve()):
            return None
        # Not blocking: a FIFO that took the file's place would wait for its writer for ever.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
        file = FileIO(os.open(path, flags))
    except (OSError, ValueError, RuntimeError):  # RuntimeError: links in a circle, until Python 3.12
        return None
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    return None


def byte_range(header: str, size: int) -> tuple[int, int] | None:
    """(first byte, one past the last) that a Range header asks of a file; None if that cannot be had, or is several."""
    match = _RANGE.fullmatch(header.strip())
    if not match or not (match[1] or match[2]):
        return None
    if not match[1]:
        start, stop = max(0, size - int(match[2])), size
    else:
        start, stop = int(match[1]), min(size, int(match[2]) + 1) if match[2] else size
    return (start, stop) if start < stop else None


async def send(request: web.Request, file: FileIO, name: str) -> web.StreamResponse:
    """Answer with an open file, or the part that is asked for; texts and programs packed, where the client reads that.

    A file that shrinks meanwhile ends the connection.
    """
    status = os.fstat(file.fileno())
    size, etag = status.st_size, f"{status.st_ino:x}-{status.st_mtime_ns:x}-{status.st_size:x}"
    headers, packs = {"Accept-Ranges": "bytes", "ETag": f'"{etag}"'}, Path(name).suffix.lower() in PACKED_TYPES
    if packs:
        headers["Vary"] = "Accept-Encoding"
    if any(tag.value in (etag, "*") for tag in request.if_none_match or ()):
        return web.Response(status=304, headers=headers)
    start, stop, code = 0, size, 200
    wanted = request.headers.get("Range")
    if wanted is not None and request.headers.get("If-Range", f'"{etag}"') == f'"{etag}"':
        found = byte_range(wanted, size)
        if found is None:
            return web.Response(status=416, headers=headers | {"Content-Range": f"bytes */{size}"})
        (start, stop), code = found, 206
        headers["Content-Range"] = f"bytes {start}-{stop - 1}/{size}"
    kind = _TYPES.get(Path(name).suffix.lower()) or mimetypes.guess_type(name)[0]
    headers["Content-Type"] = kind or "application/octet-stream"
    response = web.StreamResponse(status=code, headers=headers)
    if code == 200 and packs:
        response.enable_compression()  # by what the client reads; as a web host would, so that bytes can be counted
    else:
        response.content_length = stop - start
    await response.prepare(request)
    if request.method != "HEAD":
        await asyncio.to_thread(file.seek, start)
        await _copy(request, response, file, stop - start)
    return response


async def _copy(request: web.Request, response: web.StreamResponse, file: FileIO, left: int) -> None:
    while left:
        try:
            data = await asyncio.to_thread(file.read, min(CHUNK, left))
        except OSError:
            data = b""
        if not data:
            if request.transport:
                request.transport.abort()  # the length has been promised: a clean end would pass for the whole file
            return
        left -= len(data)
        try:
            await asyncio.wait_for(response.write(data), WRITE_PATIENCE)
        except TimeoutError:
            if request.transport:
                request.transport.abort()
            return
