"""How well an asset's frames between frames show what the actor did there, on cameras held out of training.

python -m bench.between data/actor --work data/actor/between

The actor is procedural, so the truth at any time can be rendered. Four ways to fill the time between two frames are
scored against it, from the baked textures on the meshes that ship (no codec): repeating the frame before, mixing both,
the asset's own way (export/between.py), and, as the bound that the model's own error sets, the frames beside it, each
against its own truth on the same pixels. What was rendered and scored is kept in --work and not made again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from PIL import Image

from facefolds_core.captures.actor import frame_times, make_rig, render
from facefolds_core.captures.scene import Scene, Split, read_scene
from facefolds_core.config import read_stage, read_subject
from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.export.between import Moved, between_rows, sources
from facefolds_core.export.stores import read_meshes
from facefolds_core.files import atomic_file, read_json, write_json
from facefolds_core.frame_store import FrameStore
from facefolds_core.params import CaptureParams
from facefolds_core.paths import SubjectFolders
from facefolds_core.progress import progress
from facefolds_core.rendering import Hits, composite
from facefolds_core.rendering.raster import cast_layers
from facefolds_core.scoring.metrics import shown

MOVES = 0.05
"""A pixel moves if a channel of the truths at the time and at the frames around it differs by more between any two."""
TRAINING_EVERY = 7
"""With --split train, every so many-th training camera is looked at."""

Codes = NDArray[np.uint8]
Textures = Sequence[Codes]


@dataclass(frozen=True)
class Truth:
    """What one camera would have seen: pictures (M, H, W, 3) and the subject's opacity (M, H, W), uint8, at M times."""

    pictures: Codes
    opacity: Codes


@dataclass(frozen=True)
class Score:
    """Squared errors of one picture, summed, with the weights that they were summed with.

    Attributes:
        method: of METHODS.
        camera: its index in the scene.
        frame: k of the interval from k to k + 1.
        subject, subject_weight: over the subject, weighted with its opacity.
        moving, moving_weight: likewise, over its pixels that move.
    """

    method: str
    camera: int
    frame: int
    subject: float
    subject_weight: float
    moving: float
    moving_weight: float


def repeated(store: FrameStore, factor: int) -> Iterator[tuple[int, Textures]]:
    layers, frames = _size(store)
    for k in range(frames - 1):
        for step in range(1, factor):
            yield k * factor + step, [store.image(n, k) for n in range(layers)]


def mixed(store: FrameStore, factor: int) -> Iterator[tuple[int, Textures]]:
    layers, frames = _size(store)
    still = sources(np.zeros((store.height, store.width, 2), np.float32))
    for k in range(frames - 1):
        for step in range(1, factor):
            share = np.full((store.height, store.width, 1), step / factor, np.float32)
            mixture = Moved(still, still, share)
            yield k * factor + step, [mixture.image(store.image(n, k), store.image(n, k + 1)) for n in range(layers)]


def moved(store: FrameStore, factor: int) -> Iterator[tuple[int, Textures]]:
    for frame, rows in groupby(between_rows(store, factor, progress=False), lambda row: row[1]):
        textures = [image for _, _, image in rows]
        if frame % factor and frame < (_size(store)[1] - 1) * factor:
            yield frame, textures


METHODS: dict[str, Callable[[FrameStore, int], Iterator[tuple[int, Textures]]]] = {
    "repeat": repeated,
    "cross-fade": mixed,
    "ours": moved,
}
BOUND = "frames"


def _size(store: FrameStore) -> tuple[int, int]:
    """(layers, frames)."""
    layers, frames = (1 + max(key[i] for key in store.keys()) for i in (0, 1))  # noqa: SIM118
    return layers, frames


def truth_of(folders: SubjectFolders, scene: Scene, camera: int, factor: int, work: Path) -> Truth:
    """At all frames of the asset up to the capture's last; rendered once and kept in `work`.

    Raises:
        UserError: if the scene does not hold the actor's pictures as they were rendered.
    """
    path = work / f"truth_{camera:02d}_{factor}.npz"
    if not path.exists():
        params = read_stage(CaptureParams, folders.config)
        rig = {view.name: view for view in make_rig(params).cameras}
        times = frame_times(params.model_copy(update={"frames": factor * params.frames}))
        view = rig[scene.cameras[camera].name]
        last = factor * (scene.num_frames - 1) + 1
        pictures = [
            render(view, float(t), seed=params.seed) for t in progress(times[:last], desc=view.name, unit="picture")
        ]
        opacity = np.stack([np.rint(255 * picture.opacity).astype(np.uint8) for picture in pictures])
        with atomic_file(path) as temporary:
            np.savez_compressed(temporary, pictures=np.stack([p.rgb for p in pictures]), opacity=opacity)
    with np.load(path, allow_pickle=False) as archive:
        truth = Truth(archive["pictures"], archive["opacity"])
    if not np.array_equal(truth.pictures[0], scene.open_frames().image(camera, 0)):
        raise UserError(
            "the scene does not show what the actor's renderer shows",
            file=scene.folder,
            expected="the actor's pictures at their own size, not stabilised",
            remedy=f"delete {path} if the capture has changed; use a subject of source actor with default `normalize`",
        )
    return truth


def score(
    method: str, camera: int, frame: int, picture: NDArray[np.float32], truth: Truth, at: int, factor: int
) -> Score:
    """Of a picture over black, against the truth at index `at`, in the interval of the capture's frame `frame`."""
    around = truth.pictures[frame * factor : (frame + 1) * factor + 1].astype(np.int16)
    moves = (around.max(0) - around.min(0)).max(-1) > MOVES * 255
    square = ((shown(picture) - truth.pictures[at] / 255.0) ** 2).mean(-1)
    weight = truth.opacity[at] / 255.0
    sums = (square * weight).sum(), weight.sum(), (square * weight * moves).sum(), (weight * moves).sum()
    return Score(method, camera, frame, *(float(x) for x in sums))


def scores_of(
    method: str, store: FrameStore, hits: dict[int, Hits], truths: dict[int, Truth], factor: int
) -> Iterator[Score]:
    """Of all times between frames; the bound takes both frames around each."""
    if method != BOUND:
        for at, textures in METHODS[method](store, factor):
            for camera, cast in hits.items():
                yield score(method, camera, at // factor, composite(cast, textures)[0], truths[camera], at, factor)
        return
    layers, frames = _size(store)
    for k in range(frames):
        textures = [store.image(n, k) for n in range(layers)]
        for camera, cast in hits.items():
            picture = composite(cast, textures)[0]
            for interval in (k - 1, k):
                if 0 <= interval < frames - 1:
                    yield score(method, camera, interval, picture, truths[camera], k * factor, factor)


def fast_intervals(scores: Iterable[Score]) -> set[int]:
    """The half of the intervals (rounded down) with the largest share of pixels that move."""
    shares: dict[int, list[float]] = {}
    for found in scores:
        if found.method == "repeat":
            shares.setdefault(found.frame, []).append(found.moving_weight / found.subject_weight)
    ordered = sorted(shares, key=lambda frame: -float(np.mean(shares[frame])))
    return set(ordered[: len(ordered) // 2])


def decibels(scores: Sequence[Score], region: str) -> float:
    """PSNR over all pixels of a region of all pictures together."""
    error, weight = (sum(getattr(s, name) for s in scores) for name in (region, f"{region}_weight"))
    return float(-10 * np.log10(error / weight)) if weight and error else float("nan")


def table(scores: Sequence[Score]) -> str:
    """Markdown."""
    fast = fast_intervals(scores)
    columns: dict[str, Callable[[Score], bool]] = {
        "all": lambda s: True,
        "fast": lambda s: s.frame in fast,
        "still": lambda s: s.frame not in fast,
    }
    head = [f"{name}, {region}" for region in ("moving", "subject") for name in columns]
    lines = [f"| between frames | {' | '.join(head)} |", "|---" * (1 + len(head)) + "|"]
    for method in dict.fromkeys(s.method for s in scores):
        chosen = [
            decibels([s for s in scores if s.method == method and keep(s)], region)
            for region in ("moving", "subject")
            for keep in columns.values()
        ]
        lines.append(f"| {method} | {' | '.join(f'{value:.2f}' for value in chosen)} |")
    return "\n".join(lines)


def measure(folders: SubjectFolders, work: Path, split: Split, factor: int) -> list[Score]:
    """All scores; those of a method that is in `work` already are read from there."""
    if read_subject(folders.config).source != "actor":
        raise UserError(
            "there is no truth between the frames of this capture",
            file=folders.config / "subject.json",
            expected="a subject of source actor, which can be rendered at any time",
            remedy="give the folder of one, e.g. data/actor",
        )
    scene = read_scene(folders.scene)
    cameras = scene.indices("holdout") if split == "holdout" else scene.indices("train")[::TRAINING_EVERY]
    truths = {camera: truth_of(folders, scene, camera, factor, work) for camera in cameras}
    store = FrameStore(folders.textures / "textures.arrow")
    hits: dict[int, Hits] = {}
    found: list[Score] = []
    for method in (*METHODS, BOUND):
        path = work / f"{split}_{factor}_{method}.json"
        if not path.exists():
            if not hits:
                meshes = read_meshes(folders.meshes / "meshes.npz")
                hits = {camera: cast_layers(scene.cameras[camera], meshes) for camera in cameras}
            start = time.process_time()
            scores = list(scores_of(method, store, hits, truths, factor))
            typer.echo(f"between: {method}: {time.process_time() - start:.1f} processor seconds, rendering included")
            write_json(path, [asdict(s) for s in scores])
        found += [Score(**entry) for entry in read_json(path)]
    return found


def draw(path: Path, folders: SubjectFolders, truth: Truth, camera: int, intervals: Sequence[int], factor: int) -> None:
    """Rows: truth, cross-fade, ours, over black; columns: the middle of the intervals. Cut to what moves, enlarged."""
    store = FrameStore(folders.textures / "textures.arrow")
    meshes, scene = read_meshes(folders.meshes / "meshes.npz"), read_scene(folders.scene)
    cast = cast_layers(scene.cameras[camera], meshes)
    wanted = [k * factor + factor // 2 for k in intervals]
    rows = [[truth.pictures[at] / 255.0 * (truth.opacity[at] / 255.0)[..., None] for at in wanted]]
    for method in ("cross-fade", "ours"):
        rows.append([shown(composite(cast, made)[0]) for at, made in METHODS[method](store, factor) if at in wanted])
    alike = np.ptp(truth.pictures.astype(np.int16), axis=0).max(-1) <= 4 * MOVES * 255
    down, right = (np.flatnonzero(~alike.all(axis)) for axis in (1, 0))
    box = slice(down[0], down[-1] + 1), slice(right[0], right[-1] + 1)
    sheet = np.concatenate([np.concatenate([picture[box] for picture in row], 1) for row in rows])
    image = Image.fromarray(np.rint(sheet * 255).astype(np.uint8))
    with atomic_file(path) as temporary:
        image.resize((2 * image.width, 2 * image.height), Image.Resampling.BICUBIC).save(temporary, quality=88)


def main(
    subject: Annotated[Path, typer.Argument(help="Folder of an exported actor: scene, meshes, textures.")],
    work: Annotated[Path, typer.Option(help="Folder for what is rendered and scored; a second run uses it again.")],
    split: Annotated[str, typer.Option(help="Cameras: holdout, or train (a seventh of them).")] = "holdout",
    factor: Annotated[int, typer.Option(min=2, max=3, help="Times the capture's frame rate.")] = 2,
    picture: Annotated[Path | None, typer.Option(help="Write the first camera's fast intervals there (JPEG).")] = None,
) -> None:
    """Score frames between frames against the actor's truth."""
    with report_user_errors("between"):
        if split not in ("holdout", "train"):
            raise UserError("no such cameras", place="--split", expected="holdout or train", found=split)
        work.mkdir(parents=True, exist_ok=True)
        scores = measure(SubjectFolders(subject), work, "train" if split == "train" else "holdout", factor)
        typer.echo(f"\n{split} cameras, {factor} times the frame rate; dB against the truth\n{table(scores)}")
        fast = sorted(fast_intervals(scores))
        typer.echo(f"fast: the intervals after frames {', '.join(map(str, fast))}")
        if picture is not None:
            camera, folders = scores[0].camera, SubjectFolders(subject)
            truth = truth_of(folders, read_scene(folders.scene), camera, factor, work)
            draw(picture, folders, truth, camera, fast, factor)


if __name__ == "__main__":
    typer.run(main)
