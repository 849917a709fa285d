"""The documents' pictures of a subject, and whether they are still what would be made today.

python -m docs.tools.pictures              makes face.webp, actor, frames, limits, report, player and sizes.jpg
python -m docs.tools.pictures --check      refuses pictures that are not of this asset, these options, or were edited

What each was made from stands in docs/images/made.json; report.jpg needs `facefolds report data/actor` and Chromium,
player.jpg and sizes.jpg Chromium and the player that `make view` builds.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from PIL import Image
from playwright.sync_api import Browser

from bench.results import ROOT, commit_name
from facefolds_core.asset import read_asset
from facefolds_core.captures.actor import ActorOptions, camera_at, render
from facefolds_core.captures.scene import read_scene
from facefolds_core.cli.render import shrink
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files.pictures import open_picture
from facefolds_core.files.writing import atomic_file, file_sha256, read_json, write_json
from facefolds_core.rendering.areas import view_of
from facefolds_core.rendering.camera_paths import Eye, camera_of, frame_due, turntable
from facefolds_core.rendering.opengl import OpenGLRenderer
from facefolds_core.rendering.pixels import SIDE, finer
from facefolds_core.serving.player import find_player
from facefolds_core.serving.server import serving
from facefolds_core.spacing import spread
from tests.chromium import headless

IMAGES = ROOT / "docs" / "images"
RECORD = "made.json"
FILM: dict[str, Any] = {"size": [384, 480], "pictures": 90, "milliseconds": 50, "sweep": 40, "quality": 72}
FILM |= {"field_of_view": 18.5, "target": [-0.1, 0.0, -0.035], "background": [22, 24, 29], "samples": 2}
"""A turntable in which the film plays over and over, as fast as it was filmed: its whole frames, three times 1.5 s."""
SHEET: dict[str, Any] = {"quality": 88}
PAGE: dict[str, Any] = {"widths": [1280, 390], "height": 1000, "gap": 24, "patience": 6000, "quality": 82}
"""CSS pixels: a desktop, and a phone beside it; milliseconds until the player in it plays."""
PLAYER: dict[str, Any] = {"gap": 20, "width": 1600, "patience": 1500, "quality": 86}
SIZES: dict[str, Any] = {**PLAYER, "gap": 40, "width": 1200}
PLAYER |= {"panes": [[1000, 660, "frame=4"], [1000, 660, "frame=0&spread=1&background=daylight"]]}
PLAYER["panes"] += [[390, 660, "frame=0"]]
SIZES["panes"] = [[1440, 900, "frame=0&background=white"], [390, 844, "frame=0&background=grey"]]
SIZES["panes"] += [[360, 240, "frame=0&background=daylight"], [360, 240, "frame=0&background=transparent"]]
"""CSS pixels of the windows, and what each shows, as in the player's links (a transparent one stands before a picture
of her room); the picture's width; milliseconds for what glides."""
FULL = "document.querySelector('facefolds-player').level === 'full'"
LIMITS: dict[str, Any] = {"size": [500, 768], "panel": [216, 264], "gap": 6, "frame": 2, "quality": 85}
LIMITS |= {"views": [[115, 8, 30, 40, 440], [24, 12, 220, 25, 216], [4, 2, 130, 380, 216]]}
"""Azimuth and elevation in degrees, then left, top and width of what is cut out of a picture of `size`, pixels."""


FRAMES: dict[str, Any] = {"camera": "A011", "panel": [110, 126], "columns": 9, "most": 36, "gap": 4, "quality": 84}
FRAMES |= {"corners": [[-58, -34, 930], [58, 92, 930]]}
"""A held-out camera; pixels of a picture, pictures a row, frames at most; eyes and mouth lie between the corners,
millimetres in the world of the actor's capture."""


class Picture(NamedTuple):
    """One file of `IMAGES`: from which file of the subject it is known to be old, and how it is made."""

    source: str
    options: dict[str, Any]
    make: Callable[[Path, Path], None]


def film(subject: Path, out: Path) -> None:
    """The asset turns and plays: animated WebP, an endless loop."""
    shown, (width, height) = read_asset(subject / "asset").full, FILM["size"]
    start, samples = Eye(distance=1.0, target=tuple(FILM["target"])), FILM["samples"]
    background = tuple(value / 255 for value in FILM["background"])
    pictures, rate = [], Fraction(1000, FILM["milliseconds"])
    with OpenGLRenderer(shown, shown.reflection()) as renderer:
        for index, eye in enumerate(turntable(start, FILM["pictures"], (FILM["sweep"], FILM["sweep"]))):
            camera = finer(camera_of(eye, width, height, FILM["field_of_view"]), samples)
            frame = frame_due(index, rate, shown.entry.texture.rate, shown.num_frames)
            rgb = renderer.render(camera, frame, background)[0]
            pictures.append(Image.fromarray(shrink(rgb, samples)))
    options = {"duration": FILM["milliseconds"], "loop": 0, "quality": FILM["quality"], "method": 6}
    pictures[0].save(out, "WEBP", save_all=True, append_images=pictures[1:], **options)


def sheet(subject: Path, out: Path) -> None:
    """Truth, model, asset and error, as `evaluate` draws them."""
    picture = open_picture(subject / "evaluation" / "contact_sheet.png")
    picture.convert("RGB").save(out, "JPEG", quality=SHEET["quality"], optimize=True)


def limits(subject: Path, out: Path) -> None:
    """What an asset lacks, three times truth and asset side by side, both in the actor's room."""
    shown, scene = read_asset(subject / "asset").full, read_scene(subject / "scene")
    (width, height), panel, frame, gap = LIMITS["size"], LIMITS["panel"], LIMITS["frame"], LIMITS["gap"]
    shots = []
    with OpenGLRenderer(shown, shown.reflection()) as renderer:
        for azimuth, elevation, left, top, wide in LIMITS["views"]:
            camera = camera_at("limit", azimuth, elevation, width, height)
            truth, room = (
                render(camera, float(scene.times[frame]), ActorOptions(away=away)).rgb for away in (0.0, 1.0)
            )
            behind = (room / 255.0).repeat(SIDE, 0).repeat(SIDE, 1)
            drawn = shrink(renderer.render(finer(camera.transformed(scene.from_capture)), frame, behind)[0], SIDE)
            box = (left, top, left + wide, top + wide * panel[1] // panel[0])
            for rgb in (truth, drawn):
                shots.append(Image.fromarray(rgb).crop(box).resize(panel, Image.Resampling.LANCZOS))
    # Wider gaps between the three than within a pair.
    places = [(panel[0] + gap) * k + 3 * gap * (k // 2) for k in range(len(shots))]
    whole = Image.new("RGB", (places[-1] + panel[0], panel[1]), "white")
    for left, shot in zip(places, shots, strict=True):
        whole.paste(shot, (left, 0))
    whole.save(out, "JPEG", quality=LIMITS["quality"], optimize=True)


def every_frame(subject: Path, out: Path, options: dict[str, Any]) -> None:
    """Eyes and mouth of every frame, or of as many, evenly, as there is room for: the photo above the asset, which
    stands in the empty room. `options` as `FRAMES`."""
    asset, scene = read_asset(subject / "asset"), read_scene(subject / "scene")
    panel, columns, gap = options["panel"], options["columns"], options["gap"]
    index = next(i for i, camera in enumerate(scene.cameras) if camera.name == options["camera"])
    photos, plates = scene.open_frames(), scene.open_plates()
    corners = scene.from_capture.apply(np.array(options["corners"], float))
    room = None if plates is None else plates.image(index, 0) / 255
    pairs = []
    for frame in spread(range(scene.num_frames), options["most"]):
        seen, _ = scene.camera_in_head(index, frame).project(corners)
        box = tuple(np.rint([*seen.min(0), *seen.max(0)]).astype(int).tolist())
        rgb, alpha = view_of(asset.full, scene.cameras[index], frame).composite(asset.frame(frame))
        drawn = rgb + (1 - alpha[..., None]) * (1.0 if room is None else room)
        both = photos.image(index, frame), np.rint(255 * drawn.clip(0, 1)).astype(np.uint8)
        cut = [Image.fromarray(rgb).crop(box).resize(panel, Image.Resampling.LANCZOS) for rgb in both]
        pairs.append(np.vstack([np.asarray(one) for one in cut]))
    pairs = [np.pad(pair, ((0, 2 * gap), (0, gap), (0, 0)), constant_values=255) for pair in pairs]
    pairs += [np.full_like(pairs[0], 255)] * (-len(pairs) % columns)
    rows = [np.hstack(pairs[k : k + columns]) for k in range(0, len(pairs), columns)]
    Image.fromarray(np.vstack(rows)).save(out, "JPEG", quality=options["quality"], optimize=True)


def page(subject: Path, out: Path) -> None:
    """The top of the subject's report, as a desktop and a phone show it.

    Raises:
        UserError: if there is no report, or no Chromium.
    """
    if not (report := subject / "report.html").exists():
        raise UserError("no report", file=report, remedy=f"run `facefolds report {subject}` first")
    with headless() as started:
        sizes = [(width, PAGE["height"]) for width in PAGE["widths"]]
        shots = [screen(started, report.resolve().as_uri(), size, PAGE["patience"]) for size in sizes]
    side_by_side(shots, PAGE["gap"], out, PAGE["quality"])


def player(options: dict[str, Any], subject: Path, out: Path) -> None:
    """The player's page in several windows side by side: `PLAYER`, `SIZES`.

    Raises:
        UserError: if there is no player, or no Chromium.
    """
    with serving(find_player(), {"asset": subject / "asset"}) as address, headless() as started:
        shots = [
            screen(
                started,
                f"{address}?src=asset/#level=full&{view}",
                size,
                options["patience"],
                FULL,
                room(*size) if "transparent" in view else None,
            )
            for *size, view in options["panes"]
        ]
    side_by_side(shots, options["gap"], out, options["quality"], options["width"])


def room(width: int, height: int) -> str:
    """The actor's empty room, as an address of CSS."""
    picture = render(camera_at("room", 0, 0, width, height), 0.0, ActorOptions(away=1.0)).rgb
    held = io.BytesIO()
    Image.fromarray(picture).save(held, "PNG")
    return f"url(data:image/png;base64,{base64.b64encode(held.getvalue()).decode()})"


def screen(
    started: Browser,
    address: str,
    size: Sequence[int],
    patience: int,
    there: str = "true",
    behind: str | None = None,
) -> Image.Image:
    """A page in a window of `size` CSS pixels (a narrow one is a phone's), `patience` ms after `there` holds.

    Args:
        behind: picture of CSS behind the player.
    """
    tab = started.new_page(viewport={"width": size[0], "height": size[1]}, has_touch=size[0] < 500)
    tab.goto(address)
    if behind is not None:
        tab.evaluate("behind => (document.querySelector('facefolds-player').style.backgroundImage = behind)", behind)
    tab.wait_for_function(f"() => {there}", timeout=120_000)
    tab.wait_for_timeout(patience)
    shot = open_picture(tab.screenshot()).convert("RGB")
    tab.close()
    return shot


def side_by_side(shots: Sequence[Image.Image], gap: int, out: Path, quality: int, width: int | None = None) -> None:
    """On white, all made so much smaller that they have `width` together."""
    height = max(shot.height for shot in shots)
    whole = Image.new("RGB", (sum(shot.width + gap for shot in shots) - gap, height), "white")
    for index, shot in enumerate(shots):
        whole.paste(shot, (sum(before.width + gap for before in shots[:index]), 0))
    if width is not None:
        whole = whole.resize((width, round(width * whole.height / whole.width)), Image.Resampling.LANCZOS)
    whole.save(out, "JPEG", quality=quality, optimize=True)


PICTURES = {
    "face.webp": Picture("asset/manifest.json", FILM, film),
    "actor.jpg": Picture("evaluation/contact_sheet.png", SHEET, sheet),
    "frames.jpg": Picture("asset/manifest.json", FRAMES, partial(every_frame, options=FRAMES)),
    "limits.jpg": Picture("asset/manifest.json", LIMITS, limits),
    "report.jpg": Picture("metrics.json", PAGE, page),
    "player.jpg": Picture("asset/manifest.json", PLAYER, partial(player, PLAYER)),
    "sizes.jpg": Picture("asset/manifest.json", SIZES, partial(player, SIZES)),
}


def stale(subject: Path, images: Path = IMAGES) -> list[str]:
    """What is wrong with the pictures in words; without the subject's files only what the record itself shows."""
    record, found = read_json(images / RECORD), []
    for name, picture in PICTURES.items():
        made, source = record.get(name), subject / picture.source
        if made is None or not (images / name).exists():
            found.append(f"{name}: not made by this command")
        elif made["sha256"] != file_sha256(images / name):
            found.append(f"{name}: changed since it was made")
        elif made["options"] != picture.options:
            found.append(f"{name}: made with other options")
        elif source.exists() and made["source"] != file_sha256(source):
            found.append(f"{name}: made from another {picture.source}")
    return found


def make(name: str, subject: Path, images: Path = IMAGES) -> None:
    """One picture, and its line in the record.

    Raises:
        UserError: if the subject lacks what it is made from.
    """
    picture = PICTURES[name]
    if not (source := subject / picture.source).exists():
        raise UserError("nothing to make a picture from", file=source, remedy="run `make repro`")
    with atomic_file(images / name) as temporary:
        picture.make(subject, temporary)
    record = read_json(images / RECORD) if (images / RECORD).exists() else {}
    digests = {"sha256": file_sha256(images / name), "source": file_sha256(source)}
    record[name] = {"commit": commit_name(), **digests, "options": picture.options}
    write_json(images / RECORD, dict(sorted(record.items())))


def main(
    names: Annotated[list[str] | None, typer.Argument(help=f"Of {', '.join(PICTURES)}; all if left out.")] = None,
    subject: Annotated[Path, typer.Option(help="Folder of the embedded actor's results.")] = Path("data/actor"),
    check: Annotated[bool, typer.Option("--check", help="Make nothing; refuse pictures that are stale.")] = False,
) -> None:
    """Make the documents' pictures of the embedded actor, or say which of them are stale."""
    with report_user_errors("pictures"):
        if check and (found := stale(subject)):
            raise UserError("; ".join(found), file=IMAGES / RECORD, remedy="run `python -m docs.tools.pictures`")
        if unknown := set(names or []) - set(PICTURES):
            expected = ", ".join(PICTURES)
            raise UserError("no such picture", expected=expected, found=", ".join(unknown), remedy="name one of these")
        for name in [] if check else names or PICTURES:
            make(name, subject)
            typer.echo(f"pictures: {IMAGES / name} ({(IMAGES / name).stat().st_size / 1000:.0f} kB)")


if __name__ == "__main__":
    typer.run(main)
