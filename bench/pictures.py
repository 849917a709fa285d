"""The README's picture of the web player: `python -m bench.pictures data/actor/asset`. Needs a Chromium."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from PIL import Image
from playwright.sync_api import Browser

from bench.chromium import chromium
from facefolds_core.asset import read_asset
from facefolds_core.errors import report_user_errors
from facefolds_core.files import atomic_file
from facefolds_core.pictures import open_picture
from facefolds_core.player import find_player
from facefolds_core.serving import serving

HEIGHT, DESKTOP, PHONE = 780, 1000, 390
GAP = 12
WIDTH = 1600
"""Of the picture, pixels."""
PATIENCE = 120_000
ELEMENT = "document.querySelector('facefolds-player')"


def shot(browser: Browser, address: str, width: int, view: str) -> Image.Image:
    """The player in a window of `width` x HEIGHT, at a view as in its links."""
    context = browser.new_context(viewport={"width": width, "height": HEIGHT})
    page = context.new_page()
    page.goto(f"{address}?src=asset/#{view}")
    page.wait_for_function(
        f"() => {{ const e = {ELEMENT}; return e.ready && e.level === e.levels.at(-1) }}", timeout=PATIENCE
    )
    page.mouse.move(width / 2, HEIGHT / 2)  # the controls show themselves
    page.wait_for_timeout(1500)
    data = page.screenshot(timeout=PATIENCE)
    context.close()
    return open_picture(data).convert("RGB")


def main(
    asset: Annotated[Path, typer.Argument(help="Folder of the asset.")],
    out: Annotated[Path, typer.Option(help="JPEG to write.")] = Path("docs/images/player.jpg"),
) -> None:
    """From left to right: on a desktop, with its layers pulled apart, on a phone."""
    with report_user_errors("pictures"):
        frame = read_asset(asset).num_frames // 2
        with chromium() as browser, serving(find_player(), {"asset": asset}) as address:
            panes = [
                shot(browser, address, DESKTOP, f"view=20,5,0.92,0,0,-0.02&frame={frame}"),
                shot(browser, address, DESKTOP, "view=40,14,3.6,0.4,0.1,-0.05&frame=0&spread=1&background=787c84"),
                shot(browser, address, PHONE, f"view=-15,5,0.72,0,0,-0.02&frame={frame}"),
            ]
        whole = Image.new("RGB", (sum(pane.width + GAP for pane in panes) - GAP, HEIGHT), "white")
        left = 0
        for pane in panes:
            whole.paste(pane, (left, 0))
            left += pane.width + GAP
        with atomic_file(out) as temporary:
            whole.resize((WIDTH, round(WIDTH * HEIGHT / whole.width)), Image.Resampling.LANCZOS).save(
                temporary, quality=86
            )


if __name__ == "__main__":
    typer.run(main)
