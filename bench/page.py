"""What the player's page costs: `python -m bench.page data/actor/asset`.

As Lighthouse counts, in headless Chromium: bytes by kind (as they come over the line, packed), seconds to the poster,
the first picture and the full level over lines of given speed, what the page's own thread was busy with until the first
picture, and how long tasks blocked it. And how near the pixels come to those of `facefolds render`. Nothing is cached.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from playwright.sync_api import Browser, CDPSession

from bench.results import commit_name, machine_name, now
from bench.tables import markdown
from facefolds_core.asset import read_asset
from facefolds_core.cli.render import parse_size
from facefolds_core.errors import report_user_errors
from facefolds_core.files.writing import write_json
from facefolds_core.rendering.opengl import OpenGLRenderer
from facefolds_core.rendering.pixels import finer, pixel_means
from facefolds_core.serving.player import find_player
from facefolds_core.serving.server import serving
from tests.chromium import headless
from tests.pictures import GREY, GREY_VALUE, five_cameras, psnr
from tests.viewer.captured import captured

PATIENCE = 120_000
"""Milliseconds for the full level over the slowest line."""
DELAY = 40.0
"""Milliseconds that an answer takes on its way, of every line: Lighthouse's for a desktop."""
BLOCKING = 50.0
"""Milliseconds of a task that are not felt."""
AGREEMENT_SIDE = 320
WATCH = """(() => {
  window.marks = { tasks: [] };
  new PerformanceObserver((list) => marks.tasks.push(...list.getEntries().map((e) => [e.startTime, e.duration])))
    .observe({ type: 'longtask', buffered: true });
  const look = () => {
    const e = document.querySelector('facefolds-player');
    const poster = e?.shadowRoot?.querySelector('.poster');
    if (poster?.complete && poster.naturalWidth && !poster.hidden) marks.poster ??= performance.now();
    if (e?.ready) marks.picture ??= performance.now();
    if (e && !marks.heard) {
      marks.heard = true;
      e.addEventListener('load', () => (marks.full = performance.now())); // as fine as this window shows
    }
    if (!marks.full) requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})()"""
Figures = dict[str, Any]


def kind_of(address: str) -> str:
    """Of what is fetched, by its name."""
    suffix = Path(address.split("?")[0]).suffix
    kinds = {".js": "script", ".wasm": "script", ".css": "script", "": "page", ".html": "page", ".json": "asset"}
    return kinds.get(suffix, "asset")


def measure(browser: Browser, address: str, megabits: float | None, size: tuple[int, int]) -> Figures:
    """Loads the page once, in a fresh context.

    Args:
        megabits: of the line, a second; None for the machine's own.
    """
    context = browser.new_context(viewport={"width": size[0], "height": size[1]})
    page = context.new_page()
    session = context.new_cdp_session(page)
    page.add_init_script(WATCH)
    received = _counted(session, megabits)
    page.goto(f"{address}?src=asset/")
    page.wait_for_function("() => marks.picture", timeout=PATIENCE)
    until = sum(bytes_ for _, bytes_ in received)
    spent = {entry["name"]: entry["value"] for entry in session.send("Performance.getMetrics")["metrics"]}
    page.wait_for_function("() => marks.full", timeout=PATIENCE)
    marks = page.evaluate("() => marks")
    context.close()
    blocked = [d - BLOCKING for start, d in marks["tasks"] if start < marks["picture"] and d > BLOCKING]
    kinds = {kind: sum(n for name, n in received if kind_of(name) == kind) for kind in ("page", "script", "asset")}
    return {
        "line": megabits,
        "poster": marks.get("poster", 0.0) / 1000 or None,
        "picture": marks["picture"] / 1000,
        "full": marks["full"] / 1000,
        "thread": spent["TaskDuration"],
        "script": spent["ScriptDuration"],
        "blocked": sum(blocked) / 1000,
        "bytes": {**kinds, "until_picture": until},
    }


def _counted(session: CDPSession, megabits: float | None) -> list[tuple[str, int]]:
    """Address and bytes over the line of each file, as they come in; the line is made as slow as asked."""
    names: dict[str, str] = {}
    received: list[tuple[str, int]] = []
    session.send("Network.enable")
    session.send("Performance.enable", {"timeDomain": "timeTicks"})
    session.on("Network.requestWillBeSent", lambda e: names.update({e["requestId"]: e["request"]["url"]}))
    session.on(
        "Network.loadingFinished",
        lambda e: received.append((names.get(e["requestId"], ""), int(e["encodedDataLength"]))),
    )
    if megabits is not None:
        speed = megabits * 1e6 / 8
        line = {"offline": False, "latency": DELAY, "downloadThroughput": speed, "uploadThroughput": speed}
        session.send("Network.emulateNetworkConditions", line)
    return received


def agreement(browser: Browser, address: str, asset: Path) -> dict[str, float]:
    """PSNR of the player's pixels to those of `facefolds render`, first frame, full level, by camera."""
    page = browser.new_page()
    page.goto(f"{address}?src=asset/#frame=0&level=full&background={GREY[1:]}")
    page.wait_for_function("() => document.querySelector('facefolds-player').level === 'full'", timeout=PATIENCE)
    level, grey = read_asset(asset).full, (GREY_VALUE,) * 3
    with OpenGLRenderer(level, level.reflection()) as renderer:
        found = {
            camera.name: psnr(captured(page, camera)[..., :3], pixel_means(renderer.render(finer(camera), 0, grey)[0]))
            for camera in five_cameras(AGREEMENT_SIDE)
        }
    page.close()
    return found


def table(rows: Sequence[Figures]) -> str:
    """A line a row."""
    head = ["line", "poster, s", "first picture, s", "full level, s", "thread busy, s", "of it script, s", "blocked, s"]
    head += ["kB until the picture", "of all, script", "asset"]
    lines = []
    for row in rows:
        times = [row[name] for name in ("poster", "picture", "full", "thread", "script", "blocked")]
        sizes = [row["bytes"][name] / 1000 for name in ("until_picture", "script", "asset")]
        line = "none" if row["line"] is None else f"{row['line']:g} Mbit/s"
        lines.append([line, *("–" if t is None else f"{t:.2f}" for t in times), *(f"{n:.0f}" for n in sizes)])
    return markdown(head, lines)


def main(
    asset: Annotated[Path, typer.Argument(help="Folder of the asset.")],
    lines: Annotated[str, typer.Option(help="Speeds of the line, Mbit/s; 0 for the machine's own.")] = "1.6,5,0",
    size: Annotated[str, typer.Option(help="Of the window.")] = "800x600",
    out: Annotated[Path | None, typer.Option(help="JSON to write.")] = None,
) -> None:
    """Bytes, times and main-thread time of the player's page, and its pixels' agreement with `facefolds render`."""
    with report_user_errors("page"):
        read_asset(asset)
        wanted = [float(text) or None for text in lines.split(",")]
        window = parse_size(size, film=False)
        with serving(find_player(), {"asset": asset}) as address, headless() as browser:
            rows = [measure(browser, address, line, window) for line in wanted]
            near = agreement(browser, address, asset)
        typer.echo(table(rows))
        typer.echo("dB to `facefolds render`: " + ", ".join(f"{name} {value:.1f}" for name, value in near.items()))
        if out is not None:
            conditions = {"commit": commit_name(), "machine": machine_name(""), "date": now()}
            write_json(out, conditions | {"rows": rows, "agreement": near})


if __name__ == "__main__":
    typer.run(main)
