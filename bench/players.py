"""Pictures a second in a browser: `python -m bench.players data/actor/asset`.

Assets as they ship (coarser or finer ones: docs/research/ablations.md), a Gaussian-splat player from
npm with splats of the first one's head, and one opaque mesh as the floor: in the same browser, one after the other,
from the same cameras. A picture's time runs until its pixels can be read back; nothing waits for a screen. Also: time
and bytes to the first picture, and memory. Needs Chromium, npm, and the player that `make view` builds.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import trimesh
import typer
from numpy.typing import NDArray
from playwright.sync_api import Browser
from trimesh.sample import sample_surface

from bench.results import ROOT, commit_name, machine_name, now
from bench.tables import markdown
from facefolds_core.asset import Asset, read_asset
from facefolds_core.asset.glb import write_glb
from facefolds_core.cli.render import parse_size
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.writing import write_json
from facefolds_core.rendering.reference import sample_texture
from facefolds_core.serving.player import find_player
from facefolds_core.serving.server import serving
from tests.chromium import headless

PAGES = ROOT / "bench" / "browser"
PATIENCE = 300_000
"""Milliseconds for one page to load or one picture's row to be drawn: software rendering takes its time."""
WARM_UP = 2
"""Pictures that are drawn and not counted."""
HTML = """<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">
<style>html, body {{ margin: 0; height: 100%; background: #000; overflow: hidden }}</style>
<body><script type="module" src="/{0}.js"></script></body>"""
VISIBLE = 13 / 255
"""Splats of less opacity are not worth one."""
SPREAD = 0.6
"""Standard deviation of a splat over the mean distance of its neighbours: they close, and hardly blur."""
SPLAT = np.dtype([("centre", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rotation", "u1", 4)])
"""A record of a .splat file; rotation 128 + 128 w, x, y, z."""
Entry = dict[str, Any]


def sample_splats(asset: Asset, count: int) -> NDArray[np.void]:
    """(count,) splats of the first frame, in the asset's axes: points spread evenly over what is seen of all layers.

    Nothing is fitted: centre, colour and opacity are the layer's at that place, all have one isotropic size.
    """
    solids = [trimesh.Trimesh(mesh.vertices, mesh.faces, process=False) for mesh in asset.layers]
    total, drawn, textures = sum(solid.area for solid in solids), count, asset.frame(0)
    places, colours = np.empty((0, 3)), np.empty((0, 4), np.float32)
    while len(places) < count:
        drawn, found = 2 * drawn, []
        for seed, (mesh, texture, solid) in enumerate(zip(asset.layers, textures, solids, strict=True)):
            share = round(drawn * solid.area / total)
            at, faces, weights = sample_surface(solid, share, return_barycentric=True, seed=seed)
            st = np.einsum("nk,nkc->nc", weights, mesh.st[mesh.faces[faces]]).astype(np.float32)
            rgba = sample_texture(texture, st)
            seen = rgba[:, 3] >= VISIBLE
            found.append((at[seen], rgba[seen]))
        places, colours = (np.concatenate(parts) for parts in zip(*found, strict=True))
    kept, pick = len(places), np.random.default_rng(0).permutation(len(places))[:count]
    splats = np.zeros(count, SPLAT)
    splats["centre"], splats["scale"] = places[pick], SPREAD * np.sqrt(total * (kept / drawn) / count)
    splats["rgba"] = np.rint(255 * colours[pick])
    splats["rotation"] = (255, 128, 128, 128)
    return splats


def build_pages(out: Path) -> None:
    """The pages, bundled, with the player; npm installs what is missing, once.

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
    for name in ("ours", "splats", "mesh", "index"):
        (out / f"{name}.html").write_text(HTML.format("mesh" if name == "index" else name))


def prepare(assets: Sequence[Asset], splats: Sequence[int], heads: Path) -> tuple[list[Entry], dict[str, Path]]:
    """Rows (name, page, query, ways to draw: "play" shows the next frame too), and the folders of the assets.

    Args:
        heads: folder of the pages' own files, which is made.
    """
    heads.mkdir()
    first = assets[0]
    write_glb(heads / "head.glb", first.full, "head")
    middle = first.num_layers // 2
    flat = len(first.layers[middle].faces)
    before = sum(len(mesh.faces) for mesh in first.layers[middle + 1 :])  # innermost first in the GLB
    query = f"first={3 * before}&count={3 * flat}"
    rows: list[Entry] = [{"name": f"one opaque mesh, {flat:,} triangles", "page": "mesh", "query": query}]
    for i, asset in enumerate(assets):
        triangles = sum(len(mesh.faces) for mesh in asset.layers) // asset.num_layers
        name = f"ours, {asset.num_layers} x {triangles:,} triangles"
        rows.append({"name": name, "page": "ours", "query": f"asset=asset{i}", "kinds": ["draw", "play"]})
    for count in splats:
        (heads / f"{count}.splat").write_bytes(sample_splats(first, count).tobytes())
        rows.append({"name": f"{count:,} splats", "page": "splats", "query": f"file={count}.splat"})
    return rows, {f"asset{i}": asset.folder for i, asset in enumerate(assets)}


def processes(browser: Browser) -> tuple[float, int | None]:
    """Processor seconds of all of the browser's processes so far; resident bytes of the one that draws, on Linux
    (without a graphics card textures lie there; most of it is the browser's own)."""
    listed = browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    memory = None
    for status in (Path(f"/proc/{process['id']}/status") for process in listed if process["type"] == "GPU"):
        lines = status.read_text().splitlines() if status.exists() else []
        memory = next((1024 * int(line.split()[1]) for line in lines if line.startswith("VmRSS")), None)
    return sum(float(process["cpuTime"]) for process in listed), memory


def measure_row(browser: Browser, address: str, row: Entry, sizes: Sequence[tuple[int, int]], pictures: int) -> Entry:
    """Load a page in a fresh context (nothing is cached) and draw."""
    page = browser.new_context(viewport={"width": sizes[0][0], "height": sizes[0][1]}).new_page()
    page.set_default_timeout(PATIENCE)
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.goto(f"{address}{row['page']}.html?{row['query']}")
    try:
        page.wait_for_function("() => window.loaded", timeout=PATIENCE)
    except Exception as error:
        found = "; ".join([*said, str(error)])[:600]
        raise UserError(f"the page of {row['name']} did not come up", found=found) from None
    timings = []
    for width, height in sizes:
        for kind in row.get("kinds", ["draw"]):
            page.set_viewport_size({"width": width, "height": height})
            there = "width => document.querySelector('canvas, facefolds-player') && innerWidth === width"
            page.wait_for_function(there, arg=width)
            page.evaluate(f"measure('{kind}', {WARM_UP})")
            before = processes(browser)[0]
            times = page.evaluate(f"measure('{kind}', {pictures})")
            spent = 1000 * (processes(browser)[0] - before) / pictures
            size = {"size": f"{width}x{height}", "milliseconds": float(np.median(times)), "processor": spent}
            timings.append({"row": row["name"] + (", playing" if kind == "play" else ""), **size})
    fetched: list[Entry] = page.evaluate(
        "performance.getEntriesByType('resource').map((e) => ({ name: e.name, bytes: e.decodedBodySize }))"
    )
    return {
        "row": row["name"],
        "device": page.evaluate("window.device"),
        "timings": timings,
        "loaded": page.evaluate("window.loaded"),
        "bytes": sum(entry["bytes"] for entry in fetched),
        "code": sum(entry["bytes"] for entry in fetched if entry["name"].endswith((".js", ".wasm"))),
        "computed": page.evaluate("document.querySelector('facefolds-player')?.statistics.gpuBytes ?? null"),
        "resident": processes(browser)[1],
    }


def timing_table(timings: Sequence[Mapping[str, Any]]) -> str:
    """Milliseconds a picture, pictures a second, processor milliseconds, and how many times the first row's."""
    sizes = list(dict.fromkeys(t["size"] for t in timings))
    found = {(t["row"], t["size"]): t for t in timings}
    head = [text for size in sizes for text in (f"{size}: ms", "pictures a second", "processor ms", "x floor")]
    rows = {t["row"]: [t["row"]] for t in timings}
    for name, row in rows.items():
        for size in sizes:
            t, floor = found[name, size], found[timings[0]["row"], size]
            ms, spent = t["milliseconds"], t["processor"]
            row += [f"{ms:.0f}", f"{1000 / ms:.1f}", f"{spent:.0f}", f"{spent / floor['processor']:.1f}"]
    return markdown(["", *head], list(rows.values()))


def main(
    assets: Annotated[list[Path], typer.Argument(help="Folders of assets; splats and mesh are of the first.")],
    splats: Annotated[str, typer.Option(help="Numbers of splats.")] = "100000,300000",
    sizes: Annotated[str, typer.Option(help="Of the pictures.")] = "1280x720,2560x1440",
    pictures: Annotated[int, typer.Option(help="Pictures a measurement.", min=1)] = 8,
    out: Annotated[Path, typer.Option(help="JSON to write.")] = Path("data/players.json"),
) -> None:
    """Compare players of the same head, each in a browser started anew; what loading took is in the JSON."""
    with report_user_errors("players"), tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        build_pages(place / "site")
        counts = [int(count) for count in splats.split(",") if count]
        rows, folders = prepare([read_asset(folder) for folder in assets], counts, place / "site" / "heads")
        wanted = [parse_size(text, film=False) for text in sizes.split(",")]
        found = []
        with serving(place / "site", folders) as address:
            for row in rows:
                with headless("--disable-gpu-vsync") as browser:
                    found.append(measure_row(browser, address, row, wanted, pictures))
                typer.echo(f"players: {row['name']}: {found[-1]['timings'][0]['milliseconds']:.0f} ms")
        typer.echo(timing_table([t for entry in found for t in entry["timings"]]))
        conditions = {"commit": commit_name(), "machine": machine_name(found[0]["device"]), "date": now()}
        write_json(out, conditions | {"pictures": pictures, "rows": found})


if __name__ == "__main__":
    typer.run(main)
