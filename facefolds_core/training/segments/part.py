"""A part of a take's training, for a job of its own: the base, or one segment, left where `train` takes it up.

    python -m facefolds_core.training.segments.part --subject NAME --part base
    python -m facefolds_core.training.segments.part --subject NAME --part 7

The base comes first. It leaves `plan.json` in data/NAME/checkpoints/take: what segments there are, by number.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from tqdm import tqdm

from facefolds_core.captures.found_scene import found_scene
from facefolds_core.captures.scene import Scene
from facefolds_core.config import read_train
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import read_json, write_text
from facefolds_core.params import ExplicitParams
from facefolds_core.paths import SubjectFolders, subject_folders
from facefolds_core.processes import end_with_parent
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.fitting import fit_segment
from facefolds_core.training.segments.forecast import check_forecast, forecast
from facefolds_core.training.segments.handed import Fitting
from facefolds_core.training.segments.loop import base_of
from facefolds_core.training.segments.names import BASE, PLAN
from facefolds_core.training.segments.plan import Segment, plan_take


def make_base(folders: SubjectFolders, scene: Scene, params: ExplicitParams, begun: Path | None = None) -> str:
    """Plan the take and train its base; says what was made. `begun`: see `train_base`."""
    place = folders.checkpoints / "take"
    told = forecast(scene, params)
    check_forecast(told, params, place)
    if told.key_frames is None:
        write_text(place / PLAN, json.dumps({"segments": []}))
        return f"{scene.num_frames} frames {told}: there are no segments"
    plan = plan_take(scene, params, told.key_frames)
    base_of(plan, scene, params, place, folders.training_log, begun)
    cache = SegmentCache(place)
    segments = [{**asdict(segment), "file": cache.path(segment.names).name} for segment in plan.segments]
    found = {"base": plan.base, "folder": f"base-{plan.base}", "keys": plan.keys, "segments": segments}
    write_text(place / PLAN, json.dumps(found))
    return f"base of {len(plan.keys)} key frames, {len(segments)} segments to come"


def make_segment(folders: SubjectFolders, scene: Scene, params: ExplicitParams, number: int) -> str:
    """Fit one segment.

    Raises:
        UserError: if the take was not planned, or has no such segment; if a frame diverges.
    """
    place = folders.checkpoints / "take"
    plan = read_json(place / PLAN, "run the part `base` first")
    if not 0 <= number < len(plan["segments"]):
        raise UserError("no such segment", place="--part", expected=f"0 to {len(plan['segments']) - 1}", found=number)
    one = plan["segments"][number]
    segment = Segment(number, tuple(one["frames"]), tuple(one["names"]), tuple(map(tuple, one["shares"])))
    fitting = Fitting(scene, params, place / plan["folder"], plan["base"], place)
    cache = fitting.cache()
    if not cache.has(segment.names):
        fit_segment(segment, fitting.fitter(), cache, lambda: None)
    return f"segment {number + 1} of {len(plan['segments'])}, frames {segment.frames[0]} to {segment.frames[-1]}"


def command(
    subject: Annotated[str, typer.Option(help="Name in params.yaml.")],
    part: Annotated[str, typer.Option(help="base, or the number of a segment, from 0 on.")],
    data: Annotated[Path, typer.Option(help="Folder that holds one folder a subject.")] = Path("data"),
    begun: Annotated[Path | None, typer.Option(help="Folder of the base's checkpoint; by default beside it.")] = None,
) -> None:
    """Train a part of a take."""
    with report_user_errors("train"):
        end_with_parent()
        folders = subject_folders(data, subject)
        params = read_train(folders.config)
        if not isinstance(params, ExplicitParams):
            raise UserError("a model without segments", place=f"train.model of {subject}", expected="explicit")
        scene = found_scene(folders)
        if part == BASE:
            made = make_base(folders, scene, params, begun)
        else:
            made = make_segment(folders, scene, params, int(part))
        tqdm.write(f"train: {made}")


if __name__ == "__main__":
    typer.run(command)
