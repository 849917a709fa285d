"""Play an asset in a browser: `facefolds view data/<subject>/asset`."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser
from pathlib import Path
from typing import Annotated
from urllib.parse import urlencode

import typer

from facefolds_core.asset.manifest_file import MANIFEST_NAME, parse_manifest
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.reading import is_folder
from facefolds_core.serving.player import find_player
from facefolds_core.serving.server import serving


def latest_asset(data: Path) -> Path:
    """The asset under `data` that was made last.

    Raises:
        UserError: if there is none.
    """
    found = sorted(data.glob(f"*/asset/{MANIFEST_NAME}"), key=lambda path: path.stat().st_mtime)
    if not found:
        raise UserError(
            "no asset has been made yet", file=data, remedy="run `make repro` first, or name an asset's folder"
        )
    return found[-1].parent


def asset_folder(path: Path) -> Path:
    """The asset's folder that somebody means who names it, its manifest, the GLB beside it or its subject's folder.

    Raises:
        UserError: if there is none.
    """
    meant = path.parent if path.name == MANIFEST_NAME else path.with_suffix("") if path.suffix == ".glb" else path
    if not is_folder(meant):
        glb = "a GLB is a still of one frame, for viewers of glTF; to play the asset, " if path.suffix == ".glb" else ""
        remedy = f"{glb}name a folder that holds {MANIFEST_NAME}, such as data/actor/asset"
        raise UserError("no such folder", file=path, expected="an asset's folder", remedy=remedy)
    subject = meant / "asset"
    return subject if not (meant / MANIFEST_NAME).exists() and is_folder(subject) else meant


def has_screen() -> bool:
    """Whether a browser could open a window here."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def command(
    asset: Annotated[
        Path | None,
        typer.Argument(help="Folder of the asset, or its manifest.json. Left out: the one under --data made last."),
    ] = None,
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0 for any free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser, where there is a screen.")] = True,
) -> None:
    """Serve an asset and the web player to this machine only, and open the player. Ctrl+C ends it."""
    with report_user_errors("view"):
        named = asset_folder(asset) if asset else latest_asset(data)
        folder = named.resolve()
        parse_manifest(folder / MANIFEST_NAME)
        with serving(find_player(), {"asset": folder}, port) as root:
            address = f"{root}?{urlencode({'folder': named.as_posix()}, safe='/')}"
            typer.echo(f"view: {folder}\nview: {address}  (Ctrl+C ends)")
            if browser and has_screen():
                webbrowser.open(address)
            try:
                threading.Event().wait()
            except KeyboardInterrupt:
                typer.echo("view: ended")
