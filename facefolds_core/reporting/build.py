"""Put the page together: facts from files, what `evaluate` saw, pictures, and the template. Nothing is rendered."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from facefolds_core.asset import Asset, read_asset
from facefolds_core.captures.scene import Scene, read_scene
from facefolds_core.captures.sketch import sketch
from facefolds_core.facts import worded
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.writing import write_text
from facefolds_core.reporting import charts, pictures, tables, words
from facefolds_core.reporting.face import face
from facefolds_core.reporting.facts import Facts, finite, read_facts
from facefolds_core.scoring.panels import HEADLINES
from facefolds_core.scoring.record import Record, View, read_record
from facefolds_core.scoring.report import headline
from facefolds_core.scoring.sheets import MAX_ERROR
from facefolds_core.scoring.terminal import HEADLINE_WORDS

REPORT_NAME = "report.html"
MOST_PIXELS = 2_500_000
"""Of all compared pictures together, but for the worst: keeps the page below 5 MB."""
MOST_VIEWS = 24
TEXTURE_SIDE = 320
MOST_FILM_BYTES = 8_000_000
"""Of all films in the page together."""


@dataclass(frozen=True)
class Subject:
    """All that the page is made of.

    Attributes:
        scene: None where the normalised scene is not there.
        record: what `evaluate` saw; None where that is not there.
        views: the pictures of it that are shown.
    """

    facts: Facts
    asset: Asset
    scene: Scene | None
    record: Record | None
    views: tuple[View, ...]
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


def gather(folders: SubjectFolders, player: Path | None) -> Subject:
    facts = read_facts(folders)
    asset = read_asset(folders.asset)
    scene = read_scene(folders.scene) if (folders.scene / "scene.json").is_file() else None
    record = read_record(folders.evaluation, asset)
    return Subject(facts, asset, scene, record, chosen_views(record) if record else (), player)


def now() -> str:
    return datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")


def chosen_views(record: Record) -> tuple[View, ...]:
    """As many as the page has room for, evenly spread, the worst one always."""
    views = record.views
    most = max(1, min(MOST_VIEWS, MOST_PIXELS // views[0].truth[..., 0].size))
    fewer = min(len(views), most)
    shown = {round(i * (len(views) - 1) / max(1, fewer - 1)) for i in range(fewer)} | {record.worst}
    return tuple(view for i, view in enumerate(views) if i in shown)


def render_page(subject: Subject, folder: str) -> str:
    """The page's HTML.

    Args:
        folder: the subject's name in commands: that of its folder.
    """
    environment = page_environment()
    files = {name: Markup(_source(environment, name)) for name in ("report.css", "report.js")}
    return environment.get_template("report.html.j2").render(
        css=files["report.css"], js=files["report.js"], folder=folder, **context(subject)
    )


def page_environment() -> Environment:
    """For the templates in `page/`."""
    return Environment(
        loader=PackageLoader("facefolds_core.reporting", "page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _source(environment: Environment, name: str) -> str:
    assert environment.loader is not None
    return environment.loader.get_source(environment, name)[0]


def context(subject: Subject) -> dict[str, Any]:
    """What the template prints, section by section; empty where there is nothing to show."""
    facts, manifest, scene, record = subject.facts, subject.asset.manifest, subject.scene, subject.record
    key = headline(facts.metrics)
    places = {camera.name: tables.place_of(camera) for camera in scene.cameras} if scene else {}
    pairs = {(view.camera, view.frame): i for i, view in enumerate(subject.views)}
    compared, poster = comparisons(subject, places), subject.asset.folder / "poster.jpg"
    return {
        "subject": facts.metrics.get("subject", manifest.subject),
        "made": now(),
        "face": face(subject.asset, subject.player),
        "poster": pictures.jpeg(poster) if poster.is_file() else None,
        "generator": manifest.generator,
        "of_what": HEADLINE_WORDS[key],
        "warnings": warnings(facts.metrics),
        **films(record, scene),
        "tiles": tiles(subject, key),
        "scores": tables.scores(facts.metrics),
        "comparisons": compared,
        "error_scale": {"most": MAX_ERROR, "stops": error_stops()},
        "heat": tables.heat_map(facts.images, key, pairs, places) if facts.images else None,
        "camera_map": Markup(sketch(scene)) if scene else None,
        "worst": next((one for one in compared if one["worst"]), None),
        "patch": patch(subject),
        "textures": textures(subject),
        "curves": [(words.curve_name(name), charts.line_chart(of)) for name, of in facts.curves.items()],
        "fit_notes": [worded(one) for part in ("reasons", "events") for one in (facts.fit or {}).get(part, [])],
        "stages": tables.stages(facts.stages),
        "levels": tables.levels(manifest),
        "config": {name: json.dumps(value, indent=2) for name, value in facts.config.items()},
    }


def warnings(metrics: dict[str, Any]) -> list[str]:
    """What is not well, and what to do."""
    listed = [str(one.get("words", "")) for one in metrics.get("warnings", ()) if isinstance(one, dict)]
    return [line.removeprefix("warning: ").removeprefix("note: ") for line in listed]


def tiles(subject: Subject, key: str) -> list[dict[str, str]]:
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


def comparisons(subject: Subject, places: dict[str, tables.Place]) -> list[dict[str, Any]]:
    """Truth, asset and error of each view."""
    result: list[dict[str, Any]] = []
    for view in subject.views:
        shown = view.asset if view.over is None else view.over
        known = {name: value for name in HEADLINES if (value := view.values[name]) is not None}
        values = [f"{words.number(value)} dB {HEADLINE_WORDS[name]}" for name, value in known.items()]
        values += place_words(places.get(view.camera))
        label = words.frame_label(subject.scene.frame_ids if subject.scene else (), view.frame)
        worst = subject.record is not None and view is subject.record.views[subject.record.worst]
        result.append(
            {
                "name": f"{view.camera}, frame {label}{', the worst' if worst else ''}",
                "label": label,
                "scores": ", ".join(values),
                "worst": worst,
                "camera": view.camera,
                "frame": view.frame,
                "best": ", ".join([values[0], *place_words(places.get(view.camera))]),
                "index": len(result),
                "height": view.truth.shape[0],
                "width": view.truth.shape[1],
                "truth": pictures.photo(view.truth),
                "asset": pictures.photo(shown) if worst else "",  # as it is, at the head of the page
                "scored": pictures.photo(pictures.as_scored(view)),
                # Over the plate nothing is left out: what stands beside the subject is an error, too.
                "error": pictures.error_map(shown, view.truth, view.mask if view.over is None else None),
                "part": "of the subject alone" if view.over is None and view.mask is not None else "of the whole frame",
            }
        )
    return result


def patch(subject: Subject) -> dict[str, Any] | None:
    """The window in which the asset is worst, truth beside asset; None where it is not known."""
    crop = subject.record.patch if subject.record else None
    if crop is None:
        return None
    row, column, side = crop.box
    height, width = crop.truth.shape[:2]
    box = {"top": row / height, "left": column / width, "height": side / height, "width": side / width}
    return {
        "truth": pictures.exact(crop.truth),
        "asset": pictures.exact(crop.asset),
        "width": width,
        "height": height,
        "box": "; ".join(f"{name}: {100 * share:.1f}%" for name, share in box.items()),
        "camera": crop.camera,
        "label": words.frame_label(subject.scene.frame_ids if subject.scene else (), crop.frame),
        "psnr": words.number(crop.psnr),
    }


def films(record: Record | None, scene: Scene | None) -> dict[str, Any]:
    """Films of the held-out cameras, as many as the page has room for, and the worst picture beside them."""
    if record is None:
        return {"films": [], "films_left": 0, "film_size": (2, 1)}
    places = {camera.name: tables.place_of(camera).angle for camera in scene.cameras} if scene else {}
    kept, room = [], MOST_FILM_BYTES
    for film in sorted(record.films, key=lambda one: places.get(one.camera, 0.0)):
        path = record.folder / film.file
        size = path.stat().st_size if path.is_file() else room + 1
        if size <= room:
            room -= size
            labels = [words.frame_label(scene.frame_ids if scene else (), name) for name in film.frames]
            kept.append(
                {
                    "camera": film.camera,
                    "fps": film.fps,
                    "frames": film.frames,
                    "labels": labels,
                    "src": pictures.film(path),
                }
            )
    view = record.views[record.worst]
    width, height = view.truth.shape[1], view.truth.shape[0]
    return {"films": kept, "films_left": len(record.films) - len(kept), "film_size": (2 * width, height)}


def place_words(place: tables.Place | None) -> list[str]:
    return [f"{place.angle:.0f}° from front"] if place else []


def error_stops() -> str:
    """The error's colours as the stops of a CSS gradient."""
    return ", ".join(
        f"rgb({red:.0f} {green:.0f} {blue:.0f})" for red, green, blue in (255 * pictures.error_colours(9)).tolist()
    )


def textures(subject: Subject) -> dict[str, Any]:
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
                "src": pictures.texture(rgba, TEXTURE_SIDE),
                "opaque": words.percent(float((rgba[..., 3] >= 128).mean()), 0),
            }
            for i, rgba in enumerate(asset.frame(frame))
        ],
    }
