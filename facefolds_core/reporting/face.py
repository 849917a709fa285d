"""The asset itself in the report: the web player and its files, as a page within the page."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from facefolds_core.asset.manifest import Level
from facefolds_core.asset.reader import Asset
from facefolds_core.asset.single_page import shipped, write_single_page

MOST_FACE_BYTES = 6_000_000
"""Of the files of the level that is embedded: in the page they are a third larger."""


def face(asset: Asset, player: Path | None) -> dict[str, Any] | None:
    """The finest level that the page has room for, as a page that plays by itself; None without one or a player.

    Args:
        player: the folder of the built player.
    """
    level = embedded(asset)
    if player is None or level is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "face.html"
        write_single_page(out, asset.folder, asset.manifest, level, player)
        return {"page": out.read_text(encoding="utf-8"), "level": level.name, "full": level is asset.manifest.full}


def embedded(asset: Asset) -> Level | None:
    """The finest level whose files are few bytes enough."""
    levels = reversed(asset.manifest.levels)
    return next((one for one in levels if shipped(asset.manifest, one).full.bytes <= MOST_FACE_BYTES), None)
