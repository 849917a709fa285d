"""Pictures a second in a browser: `python -m bench.players data/actor/asset`.

Ours at few and at many triangles, a Gaussian-splat player from npm with splats of the same head, and one opaque mesh as
the floor: in the same browser, one after the other, from the same cameras. A picture's time runs until its pixels can
be read back; nothing waits for a screen. Also: time and bytes to the first picture, and memory.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from playwright.sync_api import Browser, Page

from bench.chromium import Processes, chromium
from bench.heads import sample_splats, write_single
from bench.results import commit_name, machine_name
from facefolds_core.asset import read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.asset.reader import Asset
from facefolds_core.cli.render import parse_size, pick_level
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import write_json
from facefolds_core.player import find_player
from facefolds_core.serving import serving

PAGES = Path(__file__).parent / "browser"
PATIENCE = 300_000
"""Milliseconds for one page to load or one picture's row to be drawn: software rendering takes its time."""
WARM_UP = 2
"""Pictures that are drawn and not counted."""
HTML = """<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">
<style>html, body {{ margin: 0; height: 100%; background: #000; overflow: hidden }}</style>
<body><script type="module" src="/{0}.js"></script></body>"""


@dataclass(frozen=True)
class Row:
    """What is drawn.

    Attributes:
        name: as the table says it.
        page: bench/browser/src/<page>.js.
        query: its settings.
        kinds: ways to draw a picture: "draw" moves the camera, "play" shows the next frame of the video as well.
    """

    name: str
    page: str
    query: str
    kinds: tuple[str, ...] = ("draw",)


@dataclass(frozen=True)
class Timing:
    """Of one row at one size.

    Attributes:
        milliseconds: of a picture, median.
        processor_milliseconds: of all processes of the browser, mean.
    """

    row: str
    kind: str
    width: int
    height: int
    pictures: int
    milliseconds: float
    processor_milliseconds: float


@dataclass(frozen=True)
class Loading:
    """Of one row: milliseconds since the page was asked for, and bytes.

    Attributes:
        device: what draws, in the browser's words.
        loaded: by event (`poster`, `first`, `all`, or `picture`, which waits for pixels): ms, and bytes of the asset.
        bytes: all that was fetched, scripts included, unpacked sizes.
        code_bytes: scripts and decoders thereof.
        computed_gpu_bytes: what the player says it keeps; None for others.
        measured_bytes: of the drawing process after a few pictures; None where it cannot be known. Most of it is the
            browser's own: the difference to the floor's is what counts.
    """

    row: str
    device: str
    loaded: dict[str, dict[str, float]]
    bytes: int
    code_bytes: int
    computed_gpu_bytes: int | None
    measured_bytes: int | None


@dataclass(frozen=True)
class Measured:
    """All rows.

    Attributes:
        device: what drew, in the browser's words.
    """

    browser: str
    device: str
    loadings: list[Loading]
    timings: list[Timing]


def build_pages(out: Path) -> None:
    """The pages, bundled, with the player that stands in viewer/dist; npm installs what is missing, once.

    Raises:
        UserError: if there is no npm, or the player has not been built.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise UserError("no npm", remedy="install Node.js 18 or newer with npm (apt-get install nodejs npm)")
    if not (PAGES / "node_modules").is_dir():
        subprocess.run([npm, "ci", "--no-audit", "--no-fund", "--loglevel=error"], cwd=PAGES, check=True)
    subprocess.run([npm, "run", "--silent", "build", "--", f"--outdir={out}"], cwd=PAGES, check=True)
    shutil.copytree(find_player(), out / "player", ignore=shutil.ignore_patterns("*.map"))
    for name in ("ours", "splats", "mesh"):
        (out / f"{name}.html").write_text(HTML.format(name))
    shutil.copyfile(out / "mesh.html", out / "index.html")


def prepare(
    asset: Asset, few: str, subdivisions: int, splats: Sequence[int], place: Path
) -> tuple[list[Row], dict[str, Path]]:
    """The rows, and the folders that their pages fetch from."""
    level, heads = pick_level(asset, few), place / "site" / "heads"  # no assets: the pages' own files
    folders = {"default": asset.folder, "few": place / "few", "many": place / "many"}
    heads.mkdir()
    counts = [write_single(folders[name], level, times) for name, times in (("few", 0), ("many", subdivisions))]
    layers, full = level.num_layers, asset.full
    write_glb(heads / "head.glb", level, "head")
    middle = layers // 2
    flat = len(level.layers[layers - 1 - middle].faces)  # innermost first in the GLB
    rows = [Row(f"one opaque mesh, {flat:,} triangles", "mesh", f"layer={middle}")]
    for folder, count in zip(("few", "many"), counts, strict=True):
        rows.append(Row(f"ours, {layers} x {count // layers:,} triangles", "ours", f"asset={folder}"))
    triangles = sum(len(mesh.faces) for mesh in full.layers)
    text = f"ours as it ships, {full.num_layers} x {triangles // full.num_layers:,} triangles"
    rows.append(Row(text, "ours", "asset=default", ("draw", "play")))
    for count in splats:
        (heads / f"{count}.splat").write_bytes(sample_splats(full, count).tobytes())
        rows.append(Row(f"{count:,} splats", "splats", f"file={count}.splat"))
    return rows, folders


def measure(
    address: str, rows: Sequence[Row], sizes: Sequence[tuple[int, int]], pictures: int, shots: Path | None
) -> Measured:
    """All rows, one after the other, each in a browser started anew: what one leaves in memory is not the next's."""
    timings: list[Timing] = []
    loadings: list[Loading] = []
    version = device = ""
    for row in rows:
        with chromium() as browser:
            loading, more = measure_row(browser, address, row, sizes, pictures, shots)
            version, device = browser.version, loading.device
        loadings.append(loading)
        timings += more
        for t in more:
            typer.echo(f"players: {t.row}, {t.kind}, {t.width}x{t.height}: {t.milliseconds:.0f} ms")
    return Measured(version, device, loadings, timings)


def measure_row(
    browser: Browser, address: str, row: Row, sizes: Sequence[tuple[int, int]], pictures: int, shots: Path | None
) -> tuple[Loading, list[Timing]]:
    """Load a page in a fresh context (nothing is cached) and draw."""
    processes = Processes(browser)
    context = browser.new_context(viewport={"width": sizes[0][0], "height": sizes[0][1]})
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.goto(f"{address}{row.page}.html?{row.query}")
    try:
        page.wait_for_function("() => window.loaded", timeout=PATIENCE)
    except Exception as error:
        raise UserError(f"the page of {row.name} did not come up", found="; ".join([*said, str(error)])[:600]) from None
    timings = [measure_size(page, processes, row, kind, size, pictures) for size in sizes for kind in row.kinds]
    loading = describe_loading(page, row, processes.gpu_memory())
    if shots:
        page.set_viewport_size({"width": sizes[0][0], "height": sizes[0][1]})
        page.evaluate("measure('draw', 2)")
        page.screenshot(path=shots / f"{row.page}_{row.query.split('=')[1]}.png")
    context.close()
    return loading, timings


def measure_size(page: Page, processes: Processes, row: Row, kind: str, size: tuple[int, int], pictures: int) -> Timing:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_for_function(
        "size => document.querySelector('canvas, facefolds-player') && innerWidth === size", arg=size[0]
    )
    page.evaluate(f"measure('{kind}', {WARM_UP})")
    before = processes.seconds()
    times = page.evaluate(f"measure('{kind}', {pictures})")
    spent = 1000 * (processes.seconds() - before) / pictures
    return Timing(row.name, kind, *size, pictures, float(np.median(times)), spent)


def describe_loading(page: Page, row: Row, memory: int | None) -> Loading:
    entries: list[dict[str, Any]] = page.evaluate(
        "performance.getEntriesByType('resource').map((e) => ({ name: e.name, bytes: e.decodedBodySize }))"
    )
    code = sum(entry["bytes"] for entry in entries if entry["name"].endswith((".js", ".wasm")))
    events = page.evaluate("window.loaded")
    picture = events.pop("picture")
    computed = page.evaluate("document.querySelector('facefolds-player')?.statistics.gpuBytes ?? null")
    return Loading(
        row.name,
        page.evaluate("window.device"),
        {**events, "picture": {"ms": picture}},
        sum(entry["bytes"] for entry in entries),
        code,
        computed,
        memory,
    )


def timing_table(timings: Sequence[Timing]) -> str:
    """Markdown: milliseconds a picture, and how many times the floor's."""
    sizes = sorted({(t.width, t.height) for t in timings})
    kinds = list(dict.fromkeys((t.row, t.kind) for t in timings))
    floor = {(t.width, t.height): t for t in timings if t.row == timings[0].row}
    heads = [f"{w}x{h}: ms a picture | pictures a second | processor ms | x floor" for w, h in sizes]
    lines = ["| | " + " | ".join(heads) + " |", "|---" * (1 + 4 * len(sizes)) + "|"]
    for row, kind in kinds:
        cells = [row + (", playing" if kind == "play" else "")]
        for size in sizes:
            (t,) = [t for t in timings if (t.row, t.kind, t.width, t.height) == (row, kind, *size)]
            ratio = t.processor_milliseconds / floor[size].processor_milliseconds
            cells += [
                f"{t.milliseconds:.0f}",
                f"{1000 / t.milliseconds:.1f}",
                f"{t.processor_milliseconds:.0f}",
                f"{ratio:.1f}",
            ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def loading_table(loadings: Sequence[Loading]) -> str:
    """Markdown: milliseconds and bytes to each event; memory."""

    def mebibytes(count: float | None) -> str:
        return "" if count is None else f"{count / 2**20:.1f}"

    heads = [
        "poster",
        "first picture",
        "full level",
        "its pixels",
        "asset MiB at first picture",
        "all MiB",
        "scripts MiB",
    ]
    memory = ["GPU MiB, computed", "drawing process, MiB"]
    lines = ["| | " + " | ".join([*heads, *memory]) + " |", "|---" * (1 + len(heads) + len(memory)) + "|"]
    for entry in loadings:
        times = [
            f"{entry.loaded[k]['ms']:.0f} ms" if k in entry.loaded else ""
            for k in ("poster", "first", "all", "picture")
        ]
        first = entry.loaded.get("first", {}).get("bytes")
        sizes = [first, entry.bytes, entry.code_bytes, entry.computed_gpu_bytes, entry.measured_bytes]
        lines.append("| " + " | ".join([entry.row, *times, *map(mebibytes, sizes)]) + " |")
    return "\n".join(lines)


def main(
    asset: Annotated[Path, typer.Argument(help="Folder of an asset with several levels of detail.")],
    few: Annotated[str, typer.Option(help="Level whose meshes are drawn as they are, and subdivided.")] = "medium",
    subdivisions: Annotated[int, typer.Option(help="Each cuts a triangle into 4.", min=1)] = 4,
    splats: Annotated[str, typer.Option(help="Numbers of splats.")] = "100000,300000",
    sizes: Annotated[str, typer.Option(help="Of the pictures.")] = "1280x720,2560x1440",
    pictures: Annotated[int, typer.Option(help="Pictures a measurement.", min=1)] = 8,
    shots: Annotated[Path | None, typer.Option(help="Folder for a picture of each page, to look at.")] = None,
    out: Annotated[Path, typer.Option(help="JSON to write.")] = Path("data/players.json"),
) -> None:
    """Compare players of the same head in one browser."""
    with report_user_errors("players"), tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        build_pages(place / "site")
        counts = [int(count) for count in splats.split(",") if count]
        rows, folders = prepare(read_asset(asset), few, subdivisions, counts, place)
        wanted = [parse_size(text, film=False) for text in sizes.split(",")]
        with serving(place / "site", folders) as address:
            measured = measure(address, rows, wanted, pictures, shots)
        typer.echo(timing_table(measured.timings))
        typer.echo(loading_table(measured.loadings))
        conditions = {"commit": commit_name(Path(__file__).parent), "machine": machine_name(measured.device)}
        write_json(out, conditions | {"date": datetime.now(UTC).isoformat(timespec="seconds")} | asdict(measured))


if __name__ == "__main__":
    typer.run(main)
