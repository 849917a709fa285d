"""One HTML file that plays an asset by itself, with the player and the asset's files in it: `facefolds export-html`."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator
from pathlib import Path

from facefolds_core.asset.manifest import Level, Manifest
from facefolds_core.asset.manifest_file import MANIFEST_NAME, sealed
from facefolds_core.errors import UserError
from facefolds_core.files.writing import atomic_file

PLAYER_FILE = "single.js"
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob:; connect-src blob:; "
    "img-src blob: data:; media-src blob:; style-src 'unsafe-inline'"
)
"""The page can reach nothing but itself."""
HEAD = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<meta name="color-scheme" content="dark">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
html, body {{ margin: 0; height: 100%; background: #16181d; color: #eef0f4; font-family: system-ui, sans-serif }}
facefolds-player {{ height: 100dvh }}
noscript {{ padding: 2rem }}
</style>
</head>
<body>
<noscript>This player needs JavaScript.</noscript>
<facefolds-player autoplay></facefolds-player>
"""


def shipped(manifest: Manifest, level: Level) -> Manifest:
    """The manifest with one level and one video: a file is all there at once, so others would not be shown."""
    texture = level.texture.model_copy(update={"videos": level.texture.videos[:1]})
    dropped = sum(video.bytes for video in level.texture.videos[1:])
    one = level.model_copy(update={"texture": texture, "bytes": level.bytes - dropped})
    return manifest.model_copy(update={"levels": (one,), "stream": None})


def write_single_page(out: Path, asset: Path, manifest: Manifest, level: Level, player: Path) -> int:
    """Write the page, whole or not at all; returns its bytes.

    Args:
        asset: the folder.
        manifest, level: of the asset, and which of its levels.
        player: the folder of the built player.

    Raises:
        UserError: if the player was built by an older facefolds.
    """
    script = player / PLAYER_FILE
    if not script.is_file():
        raise UserError(
            "the built player is older than this facefolds",
            file=script,
            remedy="run `make view`, which builds it again",
        )
    one = shipped(manifest, level)
    with atomic_file(out) as temporary:
        with temporary.open("w", encoding="utf-8") as page:
            page.write(HEAD.format(policy=html.escape(POLICY), title=html.escape(f"{manifest.subject} · facefolds")))
            for name, data in _files(asset, one):
                page.write(f'<script type="text/plain" data-file="{name}">{base64.b64encode(data).decode()}</script>\n')
            # In strings only: as HTML they would end the script.
            code = script.read_text(encoding="utf-8").replace("</script", "<\\/script").replace("<!--", "<\\!--")
            page.write(f"<script>{code}</script>\n</body>\n</html>\n")
        return temporary.stat().st_size


def _files(asset: Path, manifest: Manifest) -> Iterator[tuple[str, bytes]]:
    """Name and content of the manifest and of all that it names; names are plain (the manifest has been checked)."""
    yield MANIFEST_NAME, sealed(manifest)[0].encode()
    for name, _, _ in manifest.files():
        yield name, (asset / name).read_bytes()
