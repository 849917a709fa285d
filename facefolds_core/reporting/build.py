"""Put the page together: facts from files, what `evaluate` saw, pictures, and the template. Nothing is rendered."""

from __future__ import annotations

import base64
import io
import json
from dataclasses import asdict, dataclass
from datetime import datetime
from mimetypes import guess_type
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from PIL import Image

from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.captures.sketch import sketch
from facefolds_core.errors import UserError
from facefolds_core.facts import worded
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.pictures import DamagedPictureError, open_picture
from facefolds_core.files.reading import remake
from facefolds_core.files.writing import write_text
from facefolds_core.reporting import charts, tables, words
from facefolds_core.reporting.face import face
from facefolds_core.reporting.facts import Facts, finite, read_facts
from facefolds_core.scoring.films import read_films
from facefolds_core.scoring.pictures import WORST, training_picture
from facefolds_core.scoring.report import headline
from facefolds_core.scoring.terminal import HEADLINE_WORDS, warning_lines

REPORT_NAME = "report.html"
QUALITY = 85
"""Of WebP."""
SHEET_SIZE = (2600, 16_000)
TEXTURE_SIZE = (320, 320)
"""Pixels that the contact sheet, and a texture, have at most."""
MOST_FILM_BYTES = 8_000_000
"""Of all films in the page together."""


@dataclass(frozen=True)
class ReportedSubject:
    """All that the page is made of.

    Attributes:
        scene: None where the normalised scene is not there.
        evaluation: the folder of what `evaluate` saw.
    """

    facts: Facts
    asset: Asset
    scene: Scene | None
    evaluation: Path
    player: Path | None


def make_report(folders: SubjectFolders, player: Path | None = None) -> Path:
    """Write `report.html` into the subject's folder; returns its path.

    Args:
        player: folder of the built web player, to show the asset with.

    Raises:
        UserError: if the folder is not an evaluated subject's, or something in it is damaged.
    """
    page = render_page(gather(folders, player), folders.root.resolve().name)
    path = folders.root / REPORT_NAME
    write_text(path, page)
    return path


def gather(folders: SubjectFolders, player: Path | None) -> ReportedSubject:
    facts = read_facts(folders)
    asset = read_asset(folders.asset)
    scene = read_scene(folders.scene) if (folders.scene / "scene.json").is_file() else None
    return ReportedSubject(facts, asset, scene, folders.evaluation, player)


def render_page(subject: ReportedSubject, folder: str) -> str:
    """The page's HTML.

    Args:
        folder: the subject's name in commands: that of its folder.
    """
    loader = PackageLoader("facefolds_core.reporting", "page")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    css, js = (Markup(loader.get_source(environment, name)[0]) for name in ("report.css", "report.js"))
    return environment.get_template("report.html.j2").render(css=css, js=js, folder=folder, **context(subject))


def context(subject: ReportedSubject) -> dict[str, Any]:
    """What the template prints, section by section; empty where there is nothing to show."""
    facts, manifest, scene = subject.facts, subject.asset.manifest, subject.scene
    key = headline(facts.metrics)
    places = {camera.name: tables.degrees_from_front(camera) for camera in scene.cameras} if scene else {}
    poster, sheet = subject.asset.folder / "poster.jpg", subject.evaluation / "contact_sheet.png"
    return {
        "subject": facts.metrics.get("subject", manifest.subject),
        "made": datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"),
        "face": face(subject.asset, subject.player),
        "poster": stored(poster) if poster.is_file() else None,
        "generator": manifest.generator,
        "of_what": HEADLINE_WORDS[key],
        "warnings": warning_lines(facts.metrics),
        **films(subject),
        "tiles": tiles(subject, key),
        "scores": tables.scores(facts.metrics),
        "sheet": contact_sheet(sheet) if sheet.is_file() else None,
        "heat": tables.heat_map(facts.images, key, places) if facts.images else None,
        "camera_map": Markup(sketch(scene)) if scene else None,
        "worst": worst(subject),
        "bad_views": bad_views(subject),
        "textures": textures(subject),
        "curves": [(words.curve_name(name), charts.line_chart(of)) for name, of in facts.curves.items()],
        "fit_notes": [worded(one) for part in ("reasons", "events") for one in (facts.fit or {}).get(part, [])],
        "stages": tables.stages(facts.stages),
        "levels": tables.levels(manifest),
        "config": {name: json.dumps(value, indent=2) for name, value in facts.config.items()},
    }


def tiles(subject: ReportedSubject, key: str) -> list[dict[str, str]]:
    """The figures at the head of the page: those that there are."""
    metrics = subject.facts.metrics
    asset, cost = metrics.get("asset", {}), metrics.get("cost", {})
    decibels = [
        ("PSNR", asset.get(key), f"{words.region_words(metrics)}; held-out cameras"),
        ("Worst patch", asset.get("worst_patch"), "of any held-out picture"),
        ("What moves", asset.get("psnr_moving"), "where and when the photos change"),
    ]
    others = [
        ("Size", words.asset_bytes(metrics), words.size, "meshes, video and reflection"),
        ("Triangles", cost.get("triangles"), words.count, f"{words.count(subject.asset.num_layers)} layers"),
        ("Training", cost.get("train_seconds"), words.duration, str(cost.get("device") or "")),
    ]
    found = [(name, value, f"{words.number(value)}\u00a0dB", note) for name, value, note in decibels]
    found += [(name, value, form(value), note) for name, value, form, note in others]
    return [
        {"name": name, "value": text, "note": note} for name, value, text, note in found if finite(value) is not None
    ]


def worst(subject: ReportedSubject) -> dict[str, str] | None:
    """Where the asset is worst, photo beside asset: a window, or where that is not known a picture."""
    path, known = subject.evaluation / WORST, subject.facts.metrics.get("worst_patch")
    if not path.is_file():
        return None
    key = headline(subject.facts.metrics)
    scored = [one for one in subject.facts.images if one.values[key] is not None]
    if isinstance(known, dict):
        camera, frame, psnr, what = known["camera"], known["frame"], known["psnr"], "in the square, over grey"
    elif scored:
        least = min(scored, key=lambda one: one.values[key] or 0.0)
        camera, frame, psnr, what = least.camera, least.frame, least.values[key], HEADLINE_WORDS[key]
    else:
        return None
    label = words.frame_label(subject.scene.frame_ids if subject.scene else (), frame)
    return {"src": stored(path), "words": f"camera {camera}, frame {label}; {words.number(psnr)} dB {what}"}


def bad_views(subject: ReportedSubject) -> list[dict[str, str]]:
    """Photo beside asset of the training cameras that `evaluate` warned of; those whose pictures are there."""
    there = set((subject.evaluation / "pictures").glob("*.png"))  # a name in a file may lead anywhere
    facts = [one for one in subject.facts.metrics.get("warnings", ()) if isinstance(one, dict)]
    cameras = [str(one.get("camera")) for one in facts if one.get("kind") == "training_view_bad"]
    paths = {camera: training_picture(subject.evaluation / "pictures", camera) for camera in cameras}
    return [{"camera": camera, "src": stored(path)} for camera, path in paths.items() if path in there]


def films(subject: ReportedSubject) -> dict[str, Any]:
    """Films of the held-out cameras, as many as the page has room for."""
    scene = subject.scene
    places = {camera.name: tables.degrees_from_front(camera) for camera in scene.cameras} if scene else {}
    kept, left, room = list[dict[str, Any]](), 0, MOST_FILM_BYTES
    for film in sorted(read_films(subject.evaluation), key=lambda one: places.get(one.camera, 0.0)):
        path = subject.evaluation / film.file
        size = path.stat().st_size if path.is_file() else room + 1
        if size > room:
            left += 1
            continue
        room -= size
        labels = [words.frame_label(scene.frame_ids if scene else (), name) for name in film.frames]
        kept.append({**asdict(film), "labels": labels, "src": stored(path)})
    both = (2 * scene.width, scene.height) if scene else (2, 1)
    return {"films": kept, "films_left": left, "film_size": both}


def textures(subject: ReportedSubject) -> dict[str, Any]:
    """Every layer's texture of the middle frame."""
    asset = subject.asset
    frames, frame = subject.scene.frame_ids if subject.scene else (), asset.num_frames // 2
    texture = asset.manifest.full.texture
    return {
        "frame": words.frame_label(frames, frames[frame]) if frame < len(frames) else f"number {frame + 1}",
        "frames": asset.num_frames,
        "picture": f"{texture.width} × {texture.height}",
        "layers": [
            {
                "name": f"layer {i + 1}",
                "size": f"{rgba.shape[1]} × {rgba.shape[0]}",
                "src": webp(Image.fromarray(rgba), TEXTURE_SIZE),
                "opaque": words.percent(float((rgba[..., 3] >= 128).mean())),
            }
            for i, rgba in enumerate(asset.frame(frame))
        ],
    }


def contact_sheet(path: Path) -> str:
    """A large PNG as a data URI.

    Raises:
        UserError: if it is damaged.
    """
    try:
        picture = open_picture(path)
    except (OSError, DamagedPictureError) as error:
        message = "a picture of the evaluation is damaged"
        raise UserError(message, file=path, found=str(error), remedy=remake(path)) from None
    return webp(picture, SHEET_SIZE)


def webp(image: Image.Image, most: tuple[int, int]) -> str:
    """A picture (with alpha, where it has some), made smaller where it is larger than `most`, as a data URI."""
    image.thumbnail(most, Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    image.save(buffer, "webp", quality=QUALITY, method=4)
    return f"data:image/webp;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def stored(path: Path) -> str:
    """A file as it is, as a data URI."""
    return f"data:{guess_type(path.name)[0]};base64,{base64.b64encode(path.read_bytes()).decode()}"
