"""What each mechanism of the training is worth: it is switched off, all else stays, and the model is scored.

python -m bench.worth FOLDER [--only "actor; sparse"] [--without "follow; reflection"]

FOLDER keeps scenes with their subjects (`subject` is not among what is switched off) and figures; an interrupted run
goes on. Scores are of cameras set aside for choices, where a capture has true mattes of such, else of the held-out
ones, which then have chosen nothing. The table prints differences to all mechanisms together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, ClassVar

import numpy as np
import typer
from pydantic import Field

from bench.gate import CASES, params_of, strip_of
from bench.results import ROOT, Entry, Means, Store, commit_name, now
from bench.run import Project, chosen
from bench.tables import markdown
from facefolds_core.captures.found_scene import found_scene
from facefolds_core.captures.scene import Scene
from facefolds_core.config.stages import read_train
from facefolds_core.errors import report_user_errors
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.params import EvaluateParams, ExplicitParams, merged
from facefolds_core.scoring.backgrounds import Rendering
from facefolds_core.scoring.images import cutout_of, over_any
from facefolds_core.scoring.matte import interior_and_band
from facefolds_core.scoring.metrics import decibels, shown
from facefolds_core.scoring.model_view import ModelView
from facefolds_core.scoring.temporal import Film, change_of
from facefolds_core.scoring.truths import Truths
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.explicit.offsets import Offsets

NEVER = 1_000_000
TRAINING = "facefolds_core.training.explicit"


@dataclass(frozen=True)
class Off:
    """How a mechanism is switched off.

    Attributes:
        params: of the section `train`.
        code: "module:name" -> what stands there instead.
    """

    params: Mapping[str, Any] = field(default_factory=dict)
    code: Mapping[str, Any] = field(default_factory=dict)


def _nothing(*_: object) -> None:
    """In place of a step that is left out."""


def _still(surface: Offsets, frames: object, halfwidth: np.ndarray) -> tuple[Offsets, np.ndarray]:
    """In place of `over_frames`: no frame's surface lies elsewhere."""
    return surface, np.zeros_like(halfwidth)


def _no_mesh(*_: object) -> tuple[None, tuple[()]]:
    """In place of `trusted_surface`."""
    return None, ()


MECHANISMS: dict[str, Off] = {
    "nothing": Off(),
    "a belt in the chart": Off({"start": {"belts": []}}),
    "tracked mesh": Off(code={f"{TRAINING}.fit:trusted_surface": _no_mesh}),
    "wider layers where the start is blurred": Off({"geometry": {"max_halfwidth": 0.003}}),
    "second surface": Off(code={f"{TRAINING}.second_surface:LEAST_NODES": NEVER}),
    "layers reach where frames move": Off(code={f"{TRAINING}.fit:over_frames": _still}),
    "frames begin where the mesh has moved": Off(code={f"{TRAINING}.teacher:Teacher.moved": _nothing}),
    "views between the cameras": Off(code={"facefolds_core.subject.virtual:FEW": 0}),
    "layers begin as the Gaussians": Off(code={f"{TRAINING}.state:TextureState.fill": _nothing}),
    "three rounds of geometry (one)": Off({"geometry": {"rounds": [1.0]}}),
    "opacity goes back to the Gaussians'": Off(code={f"{TRAINING}.state:BELIEF": 0.0}),
    "opacity is smoothed": Off({"textures": {"smooth_every": NEVER}}),
    "four rays at outlines": Off(code={f"{TRAINING}.views:SOFT": 256}),
    "what moves is followed": Off(code={f"{TRAINING}.trainer:Trainer._follow": _nothing}),
    "reflection": Off({"reflection": {"enabled": False}}),
}
"""What can be switched off: name -> how. Prices in compiled kernels and what the stage `subject` does are not here."""

CAPTURES = ("actor", "actor, 8 cameras", "sparse", "mugsy", "moving")
SCORES = ("any", "inside", "band", "moving")


class Worth(Entry):
    """Scores of a capture's model without a mechanism, dB."""

    KEY: ClassVar[tuple[str, ...]] = ("capture", "without")
    capture: str
    without: str
    scores: Means = Field(default_factory=dict)
    commit: str = ""


@contextmanager
def patched(code: Mapping[str, Any]) -> Iterator[None]:
    """Something else stands at each "module:name", name possibly of a class's attribute."""
    before = list[tuple[Any, str, Any]]()
    for place, value in code.items():
        module, _, name = place.partition(":")
        *owners, last = name.split(".")
        owner = import_module(module)
        for one in owners:
            owner = getattr(owner, one)
        before.append((owner, last, getattr(owner, last)))
        setattr(owner, last, value)
    try:
        yield
    finally:
        for owner, last, value in reversed(before):
            setattr(owner, last, value)


def prepared(case: str, folder: Path, captures: Path) -> Project:
    """A capture's scene and subject, made once."""
    project = Project(strip_of(folder, case).with_suffix(""), "actor")
    if not (project.folders.subject / "sheet.png").exists():
        params = params_of(case, captures)
        if not CASES[case][0]:
            params["subjects"]["actor"].setdefault("validate", {"every": 6})
        project.write(params)
        project.run("configure", "capture", "normalize", "subject")
    return project


def scores_of(scene: Scene, model: RadianceManifolds) -> Means:
    """Over the cameras that may choose; else over the held-out ones. Means of errors, not of dB."""
    truths, params, films = Truths(scene), EvaluateParams(), list[Film]()
    errors: dict[str, list[float]] = {name: [] for name in SCORES[:3]}
    for index in scene.indices(scene.choice_split):
        film, view = Film(), ModelView(model, scene.camera_in_head(index, 0))
        for frame in range(scene.num_frames):
            truth = truths.at(index, frame)
            cutout = cutout_of("true", truth)
            assert truth.mask is not None and cutout is not None
            if scene.poses is not None:
                view = ModelView(model, scene.camera_in_head(index, frame), scene.poses.at(frame))
            one = Rendering(*(view.render(float(frame))[k] for k in (0, 2)))
            picture = shown(one.over(params.background))
            off = np.square(picture - truth.picture).mean(-1)
            any_background = over_any(one, cutout)["psnr_any"]
            assert any_background is not None
            errors["any"].append(10 ** (-any_background / 10))
            for name, part in zip(SCORES[1:3], interior_and_band(truth.mask), strict=True):
                weight = part * truth.mask
                errors[name].append(float((weight * off).sum() / weight.sum()))
            film.add(frame, {"": picture}, truth.picture, truth.mask)
        films.append(film)
    moving = change_of(film.sums()[""] for film in films).psnr_moving
    return {name: decibels(float(np.mean(values))) for name, values in errors.items()} | {"moving": moving}


def measure(project: Project, without: str) -> Means:
    """Train and score; in a process of its own."""
    off, given = MECHANISMS[without], read_train(project.folders.config)
    assert isinstance(given, ExplicitParams)
    params = type(given).model_validate(merged(given.model_dump(), off.params))
    scene = found_scene(project.folders)
    with patched(off.code), TemporaryDirectory() as log:
        return scores_of(scene, fit_explicit(scene, params, Path(log)).model)


def table(store: Store[Worth], cases: Sequence[str]) -> str:
    """A row a mechanism, a column a capture: what its loss costs, dB of SCORES."""
    found = {(one.capture, one.without): one.scores for one in store.read()}

    def cell(case: str, name: str) -> str:
        own, whole = found.get((case, name)), found.get((case, "nothing"))
        if own is None or whole is None:
            return ""
        values = [(own[score], whole[score]) for score in SCORES]
        if name == "nothing":
            return " / ".join("-" if one is None else f"{one:.2f}" for one, _ in values)
        return " / ".join("-" if one is None or other is None else f"{one - other:+.2f}" for one, other in values)

    return markdown(["without", *cases], [[name, *(cell(case, name) for case in cases)] for name in MECHANISMS])


@report_user_errors("worth")
def main(
    folder: Annotated[Path, typer.Argument(help="Where scenes and figures are kept.")],
    only: Annotated[str, typer.Option(help="Some captures, separated by semicolons; by default all.")] = "",
    without: Annotated[str, typer.Option(help="Some mechanisms, separated by semicolons; by default all.")] = "",
    captures: Annotated[Path, typer.Option(help="Folder of mugsy, sparse, ...")] = ROOT / "../shared/captures",
    workers: Annotated[int, typer.Option(help="Trainings at once.")] = 1,
) -> None:
    """Measure what FOLDER/worth.json does not have of this commit."""
    cases, names = chosen(only, CAPTURES, "--only"), chosen(without, tuple(MECHANISMS), "--without")
    names = list(dict.fromkeys(["nothing", *names]))
    store, commit = Store(folder / "worth.json", "worth", Worth), commit_name()
    for case in (case for case in cases if not CASES[case][0] or (captures / CASES[case][0]).is_dir()):
        project = prepared(case, folder, captures)
        known = {one.without for one in store.read() if one.capture == case and one.commit == commit}
        missing = [name for name in names if name not in known]
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
            for name, scores in zip(missing, pool.map(measure, [project] * len(missing), missing), strict=True):
                store.add(Worth(capture=case, without=name, scores=scores, commit=commit, date=now()))
                typer.echo(f"{case}, without {name}: measured")
    typer.echo(f"\n{table(store, cases)}\n")


if __name__ == "__main__":
    typer.run(main)
