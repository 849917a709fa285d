"""What the player's server gives out: the player's own files, an asset's manifest and what that names. Nothing else."""

from __future__ import annotations

import json
import mimetypes
import os
import re
from pathlib import Path

from aiohttp import web

from facefolds_core.files.reading import is_regular

MANIFEST = "manifest.json"
LARGEST_MANIFEST = 1 << 24
"""Bytes. A manifest is a few kB a level."""
PACKED_TYPES = (".html", ".js", ".css", ".json", ".wasm", ".svg")
"""Meshes, videos and pictures are packed already."""

_PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,254}")
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


def asset_file(folder: Path, name: str) -> Path | None:
    """The manifest of an asset, or a file that it names; None for anything else."""
    if name != MANIFEST and (not _PLAIN_NAME.fullmatch(name) or name not in named_files(folder)):
        return None
    return path_inside(folder, name)


def player_file(folder: Path, name: str) -> Path | None:
    """A file of the built player, in `folder` or below; None for anything else."""
    if not all(_PLAIN_NAME.fullmatch(part) for part in name.split("/")):
        return None
    return path_inside(folder, name)


def named_files(folder: Path) -> set[str]:
    """What a manifest names. Read leniently: the player says what is wrong with a manifest, not the server."""
    path = path_inside(folder, MANIFEST)
    try:
        waiting = [json.loads(path.read_bytes())] if path and path.stat().st_size <= LARGEST_MANIFEST else []
    except (OSError, ValueError, RecursionError):
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


def path_inside(folder: Path, name: str) -> Path | None:
    """A regular file in `folder` or below; None if missing, special, not readable, or led out by a link."""
    try:
        path = (folder / name).resolve(strict=True)
        inside = path.is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # RuntimeError: links in a circle, until Python 3.12
        return None
    return path if inside and is_regular(path) and os.access(path, os.R_OK) else None


def answer(path: Path, name: str) -> web.FileResponse:
    """A file, or the part that is asked for; texts and programs packed, where the client reads that."""
    suffix = Path(name).suffix.lower()
    response = web.FileResponse(path)
    response.content_type = _TYPES.get(suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
    if suffix in PACKED_TYPES:
        response.enable_compression()  # by what the client reads; as a web host would, so that bytes can be counted
    return response
