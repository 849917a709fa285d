"""Which of many posed pictures were taken by one camera, and at which moment: for layouts that list pictures.

Pictures of one camera have one pose. Where tools calibrate every picture by itself, the poses of one camera differ by a
little: then names (a folder a camera, or a folder a frame) or times tell which belong together, and the poses must
agree that they do.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.capture import closest_rotation
from facefolds_core.captures.gathering import Calibration
from facefolds_core.errors import UserError

Array = NDArray[np.float64]

STILL = 0.01
"""Poses of one camera differ by less than this: its place, over its distance from the subject, its axes in radians."""
APART = 5.0
"""Times as far from the next camera a camera stands, at least, as its own poses differ."""
FEWEST = 3
"""Cameras that poses which differ can be gathered into; fewer are one camera that moves."""
REMEDY = "mend transforms.json, or make it again with the tool that wrote it"


def wrong(path: Path, place: str, message: str, expected: object, found: object, remedy: str = REMEDY) -> UserError:
    """The error for a value that is not what it should be."""
    return UserError(message, file=path, place=place, expected=expected, found=found, remedy=remedy)


@dataclass(frozen=True)
class Shot:
    """One posed picture.

    Attributes:
        stem, folder: of its path: the name without extension, and the folder's.
        time: seconds, where the layout says it.
        w2c: (3, 4) world -> camera.
    """

    stem: str
    folder: str
    time: float | None
    w2c: Array

    @property
    def centre(self) -> Array:
        return -self.w2c[:, :3].T @ self.w2c[:, 3]


@dataclass(frozen=True)
class Arrangement:
    """Attributes:
    cameras: name -> indices of its shots.
    frames: names, in order.
    frame_of: for each shot, the name of its frame.
    """

    cameras: dict[str, list[int]]
    frames: list[str]
    frame_of: list[str]


def arrange(shots: Sequence[Shot], path: Path) -> Arrangement:
    """Sort shots into cameras and frames.

    Args:
        path: of the file that lists them, for messages.
    """
    groups = _grouped(np.round(shot.w2c, 7).tobytes() for shot in shots)
    groups = _gathered(shots, groups) or groups
    times = {shot.time for shot in shots}
    if max(len(group) for group in groups) == 1:
        if len(times) > 1:
            message = "every camera is seen at one time only, as from a single moving camera"
            expected, found = "cameras that see every frame", f"{len(groups)} cameras, {len(times)} times"
            remedy = "use a capture of several fixed cameras; for a static scene, take the `time` keys out"
            raise wrong(path, "time", message, expected, found, remedy)
        names = _unique([(shots[group[0]].stem, shots[group[0]].folder) for group in groups])
        return Arrangement(dict(zip(names, groups, strict=True)), ["0"], ["0"] * len(shots))
    timed = None not in times
    named = _time_names([time for time in times if time is not None]) if timed else {}
    # Whether the images of one camera share their name (so that folders are frames) or their folder.
    stems = all(len({shots[i].stem for i in group}) == 1 for group in groups)
    frame_of = [shot.folder if stems else shot.stem for shot in shots]
    if timed:
        frame_of = [named[shot.time] for shot in shots if shot.time is not None]
    ordered = list(named.values()) if timed else sorted(set(frame_of))
    firsts = [shots[group[0]] for group in groups]
    cameras = _unique([(s.stem, s.folder) if stems else (s.folder, s.stem) for s in firsts])
    return Arrangement(dict(zip(cameras, groups, strict=True)), ordered, frame_of)


def mean_calibration(some: Sequence[Calibration]) -> Calibration:
    """One camera whose pictures were calibrated one by one: the mean of its calibrations."""
    first = some[0]
    if len(some) == 1:
        return first
    for other in some:
        if (other.fisheye, other.coefficients.shape) != (first.fisheye, first.coefficients.shape):
            expected = f"that of {first.place}"
            raise wrong(other.file, other.place, "two lens models of one camera", expected, "another model")
    K, coefficients = (np.mean(of, axis=0) for of in ([c.K for c in some], [c.coefficients for c in some]))
    return replace(first, K=K, w2c=_mean_pose([c.w2c for c in some]), coefficients=coefficients)


def _mean_pose(poses: Sequence[Array]) -> Array:
    """(3, 4): mean centre and mean rotation of poses (3, 4) of one camera."""
    centre = np.mean([-pose[:, :3].T @ pose[:, 3] for pose in poses], axis=0)
    rotation = closest_rotation(np.concatenate([np.mean([p[:, :3] for p in poses], axis=0), np.zeros((3, 1))], 1))
    rotation[:, 3] = -rotation[:, :3] @ centre
    return rotation


def _grouped(labels: Iterable[object]) -> list[list[int]]:
    """Indices of equal labels."""
    groups: dict[object, list[int]] = defaultdict(list)
    for i, label in enumerate(labels):
        groups[label].append(i)
    return list(groups.values())


def _gathered(shots: Sequence[Shot], exact: list[list[int]]) -> list[list[int]] | None:
    """Shots of poses that differ a little, by camera: None where equal poses tell, or nothing does."""
    if len({len(group) for group in exact}) == 1 and len(exact[0]) > 1:
        return None
    folders, stems = [shot.folder for shot in shots], [shot.stem for shot in shots]
    for labels in (folders, stems, _nearest_at_first(shots)):
        found = _grouped(labels)
        if FEWEST <= len(found) < len(exact) and _agree(shots, found):
            return found
    return None


def _nearest_at_first(shots: Sequence[Shot]) -> list[object]:
    """For each shot the shot of the first time whose pose is nearest; without times nothing is gathered."""
    times = [shot.time for shot in shots if shot.time is not None]
    if len(times) < len(shots) or len(set(times)) < 2:
        return list(range(len(shots)))
    first = [i for i, shot in enumerate(shots) if shot.time == min(times)]
    centres = np.array([shots[i].centre for i in first])
    found: list[object] = [first[int(np.argmin(np.linalg.norm(centres - s.centre, axis=1)))] for s in shots]
    twice = Counter(zip(found, times, strict=True)).most_common(1)[0][1] > 1
    return list(range(len(shots))) if twice else found


def _agree(shots: Sequence[Shot], groups: list[list[int]]) -> bool:
    """Whether the poses of each group are one camera's, and those of others are others'."""
    means = [replace(shots[g[0]], w2c=_mean_pose([shots[i].w2c for i in g])) for g in groups]
    centres = np.array([mean.centre for mean in means])
    size = float(np.median(np.linalg.norm(centres - centres.mean(0), axis=1)))
    spread = max(
        float(np.linalg.norm(shots[i].centre - centre)) for g, centre in zip(groups, centres, strict=True) for i in g
    )
    turn = max(
        float(np.linalg.norm(shots[i].w2c[:, :3] - mean.w2c[:, :3]))
        for g, mean in zip(groups, means, strict=True)
        for i in g
    )
    between = np.linalg.norm(centres[:, None] - centres, axis=-1) + np.where(np.eye(len(groups)) > 0, np.inf, 0.0)
    return spread < STILL * size and turn < STILL * np.sqrt(2) and APART * spread < float(between.min())


def _time_names(times: Iterable[float]) -> dict[float, str]:
    """Names of moments, in order: six digits, or all of them where six are not enough to tell them apart."""
    ordered = sorted(set(times))
    short = [f"{time:g}" for time in ordered]
    return dict(zip(ordered, short if len(set(short)) == len(short) else map(repr, ordered), strict=True))


def _unique(candidates: list[tuple[str, str]]) -> list[str]:
    """Names of cameras: the first choice of each where these differ, else the second, else both, else numbered."""
    firsts, seconds = [first for first, _ in candidates], [second for _, second in candidates]
    for names in (firsts, seconds, [f"{second}/{first}" for first, second in candidates]):
        if max(Counter(names).values()) == 1:
            return names
    return [f"{first}-{i}" for i, (first, _) in enumerate(candidates)]
