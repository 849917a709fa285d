"""Read a capture and write it in the one convention: data/<subject>/scene/."""

from __future__ import annotations

from facefolds_core.captures.assembly import Plan, plan_scene, write_plan
from facefolds_core.captures.scene import Scene
from facefolds_core.captures.sources import read_capture
from facefolds_core.config.stages import read_stage, read_subject
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.params import CaptureParams, NormalizeParams
from facefolds_core.training.registration import with_found_poses

SHOWN = 5
"""Lines on what was left out that are printed; scene.json has all."""


def summary(plan: Plan) -> str:
    """One line on the scene."""
    scene = plan.scene
    train, checked, held = (len(scene.indices(split)) for split in ("train", "validate", "holdout"))
    aside = f"{checked} validate, {held} holdout" if checked else f"{held} holdout"
    culled = sum(one.kind == "culled" for one in scene.left_out)
    return (
        f"{len(scene.cameras)} cameras ({train} train, {aside}; {culled} culled), {scene.num_frames} frames, "
        f"{scene.width} x {scene.height} pixels, in {scene.folder}"
    )


def left_out(scene: Scene) -> list[str]:
    """The first lines on what the scene does not have, and on what is odd in it: notes come first."""
    lines = sorted(map(str, scene.left_out), key=lambda line: not line.startswith("note:"))
    shown = [f"  {line}" for line in lines[:SHOWN]]
    if len(lines) > SHOWN:
        shown.append(f"  ... and {len(lines) - SHOWN} more lines in scene.json")
    return [f"normalize: notes, and what is left out ({len(lines)}):", *shown] if lines else []


def normalize(folders: SubjectFolders) -> str:
    subject = read_subject(folders.config)
    params = read_stage(NormalizeParams, folders.config)
    capture = read_capture(subject, folders, read_stage(CaptureParams, folders.config))
    plan = plan_scene(capture, folders.root.name, subject, params, folders.scene)
    scene = with_found_poses(write_plan(plan, params), params)
    return "\n".join([summary(plan), *left_out(scene)])
