"""What `normalize` would make of a folder: for `facefolds doctor PATH`. Nothing is written, no pixel is decoded."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from facefolds_core.captures.assembly import Plan, plan_scene
from facefolds_core.captures.capture import Capture
from facefolds_core.captures.gathering import Recognised
from facefolds_core.captures.looking import describe, look
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, shorten
from facefolds_core.params import FrameRange, HoldoutEvery, NormalizeParams, Subject
from facefolds_core.registry import SOURCES

HEADERS = 3
"""Frames whose pictures' headers are read; `normalize` reads all."""
SHOWN = 12
"""Lines on what would be left out."""


def appraise(path: Path) -> Iterator[str]:
    """Lines on what a folder is, what of it would be used and what not, and the entry of params.yaml.

    Args:
        path: a folder or file.
    """
    found = look(path)
    if not found:
        what, remedy = describe(path)
        yield f"{path}: {what}"
        yield f"  nothing here reads it as it is: {remedy}"
    for source, said in found:
        yield f"{said.path}: {said.what}"
        yield from _of(source, said)


def _of(source: str, said: Recognised) -> Iterator[str]:
    keys: dict[str, Any] = dict(said.keys)
    subject = Subject(source=source, path=str(said.path.resolve()), **keys)
    try:
        capture: Capture = SOURCES[source].read(said.path, subject)
        some = subject.model_copy(update={"frames": FrameRange(stop=HEADERS), "holdout": ()})
        few: Capture = SOURCES[source].read(said.path, some)
        few = replace(few, left_out=capture.left_out)
        plan = plan_scene(few, "subject", some, NormalizeParams(), Path("scene"))
    except UserError as error:
        yield "  it cannot be used as it is:"
        yield from (f"    {line}" for line in str(error).splitlines())
        return
    yield from _used(capture, plan)
    yield from _left_out(plan.scene.left_out)
    yield "  to use it, in params.yaml:"
    yield ""
    yield from _entry(said, subject, capture, plan)
    yield ""


def _used(capture: Capture, plan: Plan) -> Iterator[str]:
    scene = plan.scene
    frames = len(capture.frame_ids)
    rate = f" at {capture.fps:g} a second" if frames > 1 else ""
    size = next(view.camera for view in capture.views)
    shrunk = "" if scene.width == size.width else f", shrunk to {scene.width} x {scene.height}"
    yield (
        f"  would be used: {len(scene.cameras)} of {len(capture.views)} cameras, {frames} "
        f"frame{'s' if frames > 1 else ''}{rate}, {size.width} x {size.height} pixels{shrunk}"
    )
    extras = [
        (capture.tracking, "a tracked mesh"),
        (capture.mattes, f"mattes of {len({c for c, _ in capture.mattes})} cameras"),
        (capture.masks, f"masks to score by of {len({c for c, _ in capture.masks})} cameras"),
        (capture.plates, f"clean plates of {len(capture.plates)} cameras"),
        (capture.sound, "sound"),
        ([view for view in capture.views if view.lens], "distortion, which is taken out"),
    ]
    has = [words for thing, words in extras if thing]
    if has:
        yield f"  it has {', '.join(has)}"


def _left_out(facts: tuple[Fact, ...]) -> Iterator[str]:
    notes = [one for one in facts if str(one).startswith("note:")]
    others = [one for one in facts if one not in notes]
    for one in notes:
        yield f"  {one}"
    if others:
        yield f"  would be left out ({len(others)}):"
        yield from (f"    {one}" for one in others[:SHOWN])
    if len(others) > SHOWN:
        yield f"    ... and {len(others) - SHOWN} more"


def _entry(said: Recognised, subject: Subject, capture: Capture, plan: Plan) -> Iterator[str]:
    """Lines of YAML; what was guessed says so."""
    yield "subjects:"
    yield f"  {_name(said.path)}:"
    yield f"    source: {subject.source}"
    yield f"    path: {_quoted(subject.path)}"
    for key, value in said.keys.items():
        yield f"    {key}: {_quoted(value)}"
    front = next((one.camera for one in plan.scene.left_out if one.kind == "front_found"), None)
    if front is not None:
        yield f"    front: {_quoted(front)}  # a guess: look at its picture"
    names = {camera.name for camera in plan.scene.cameras}
    default = HoldoutEvery(every=12)
    masked = [view.name for c, view in enumerate(capture.views) if any((c, f) in capture.masks for f in range(3))]
    masked = [name for name in masked if name in names]
    if "holdout" in said.keys:
        pass
    elif 0 < len(masked) < len(names):
        yield f"    holdout: {_quoted(masked)}  # those that have masks to score by"
    elif len(names) < default.every:
        yield f"    holdout: [{_quoted(_between(plan))}]  # a camera that others stand around"
    if len(capture.frame_ids) > 1:
        last = len(capture.frame_ids)
        yield f"    # frames: {{start: 0, stop: {last}, step: 1}}  # all of {shorten(capture.frame_ids, 3)}"


def _between(plan: Plan) -> str:
    """The camera whose neighbours stand nearest, but not the front one where there are others."""
    cameras = plan.scene.cameras
    centres = np.array([camera.centre for camera in cameras])
    away = np.linalg.norm(centres[:, None] - centres, axis=-1)
    reach = np.sort(away, 1)[:, 1 : 1 + min(2, len(cameras) - 1)].sum(1)
    if len(cameras) > 2:
        reach[int(np.argmax(centres[:, 0]))] = np.inf  # the subject faces +x
    return cameras[int(np.argmin(reach))].name


def _name(path: Path) -> str:
    """A subject's name from a folder's."""
    name = re.sub(r"[^A-Za-z0-9_]+", "-", path.resolve().stem).strip("-")[:64] or "subject"
    return f'"{name}"' if name.isdigit() else name


def _quoted(value: object) -> str:
    """For YAML: plain where nothing else can be read into it, by YAML 1.2 (DVC's) either."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_quoted, value))}]"
    text = str(value)
    plain = re.fullmatch(r"[A-Za-z/.][\w/.-]*", text) and text.lower() not in ("yes", "no", "on", "off", "true", "null")
    return text if plain else "'" + text.replace("'", "''") + "'"
