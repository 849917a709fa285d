"""data/SUBJECT/mattes: where the subject is in the pictures, to look at, to correct, to score and to train with.

- `sheet.png`: cut-outs over green, those first that the other pictures contradict, in red frames;
- `CAMERA/FRAME.png`: each that was found or named, white is the subject; what the others contradict has none;
- `mattes.arrow`: these and the capture's own, for the stages (`frame_store.FrameStore`, one channel);
- `mattes.json`: of each picture whence its matte is, and how well it agrees with the others and with true masks;
- `training/`: which of them train (captures/chosen_mattes.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image as Pillow
from tqdm import tqdm

from facefolds_core.captures.chosen_mattes import MATTES, SCENES, USE
from facefolds_core.captures.given_mattes import given_mattes
from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact
from facefolds_core.files import atomic_folder, write_json
from facefolds_core.frame_store import Image, write_frames
from facefolds_core.params import ExplicitParams, MatteParams, OutlineParams
from facefolds_core.progress import progress
from facefolds_core.spacing import spread
from facefolds_core.training.mattes.find import CutOut, Key, beside_plates, small, wanted_pictures
from facefolds_core.training.mattes.sheet import MOST, contact_sheet
from facefolds_core.training.segments.key_frames import trained_at_once
from facefolds_core.training.volume.fit import volume_frames

Finder = Callable[[Scene, Sequence[Key], OutlineParams, tqdm], list[CutOut]]
"""Mattes of some pictures of a scene from the pictures alone."""


def make_mattes(
    scene: Scene, folder: Path, params: MatteParams, start: ExplicitParams, named: Path | None, finder: Finder
) -> tuple[list[CutOut], tuple[Fact, ...]]:
    """Write the folder, whole or not at all.

    Args:
        start: the training.
        finder: of pictures without plates.
        named: folder of mattes that the user has corrected, or None.

    Returns:
        What was found or named, ordered by camera and frame, and what is to be said of how the volume was found.
    """
    store, own = scene.open_frames(), scene.open_mattes()
    given: dict[Key, Image] = {} if own is None else {key: own.image(*key) for key in own}  # mapped, not read
    by_hand = {} if named is None else {(c, k): image for c, k, image in given_mattes(named, scene)}
    found, notes = _found(scene, {**given, **by_hand}, params, start, finder)
    opacity = {
        (one.camera, one.frame): one.opacity(scene.height, scene.width)[..., None] for one in found if one.believed
    }
    opacity |= by_hand
    for (c, k), image in by_hand.items():
        found.append(CutOut(c, k, small(scene, store.image(c, k), params), small(scene, image, params), "named"))
    found.sort(key=lambda one: (one.camera, one.frame))
    with atomic_folder(folder) as temporary:
        (temporary / "training").mkdir()
        trains = {"none": {}, "all": {**given, **opacity}, "given": {**given, **by_hand}}[params.train]
        own_ones = trains.keys() == given.keys() and not by_hand
        write_json(temporary / "training" / USE, {"mattes": SCENES if own_ones else "these"})
        if not own_ones:
            _store(temporary / "training" / MATTES, scene, trains)
        if opacity:
            _store(temporary / MATTES, scene, {**given, **opacity})
        if shown := [*found, *_some_given(scene, {key: given[key] for key in given if key not in opacity}, params)]:
            Pillow.fromarray(contact_sheet(scene, shown)).save(temporary / "sheet.png")
        for (camera, frame), image in opacity.items():
            place = temporary / scene.cameras[camera].name / f"{scene.frame_ids[frame]}.png"
            place.parent.mkdir(exist_ok=True)
            Pillow.fromarray(image[..., 0]).save(place)
        write_json(temporary / "mattes.json", _described(scene, found, opacity, params))
    return found, notes


def _some_given(scene: Scene, given: Mapping[Key, Image], params: MatteParams) -> list[CutOut]:
    """Mattes of the capture, as many as the sheet has room for, spread evenly."""
    keys, store = sorted(given), scene.open_frames()
    return [
        CutOut(c, k, small(scene, store.image(c, k), params), small(scene, given[c, k], params), "capture")
        for c, k in spread(keys, MOST)
    ]


def _found(
    scene: Scene, known: Mapping[Key, Image], params: MatteParams, start: ExplicitParams, finder: Finder
) -> tuple[list[CutOut], tuple[Fact, ...]]:
    """Mattes of the pictures that serve something and have none."""
    if params.method == "none":
        return [], ()
    trained, numbers = trained_at_once(scene, start)
    every = range(scene.num_frames)
    frames = every if params.train == "all" else [numbers[k] for k in volume_frames(trained, start)]
    missing = [key for key in wanted_pictures(scene, frames) if key not in known]
    found = [] if params.method == "pictures" else beside_plates(scene, missing, params)
    done = {(one.camera, one.frame) for one in found}
    missing = [key for key in missing if key not in done]
    if params.method == "plates" or not missing:
        return found, ()
    with progress(total=len(missing), desc="matte", unit="picture") as bar:
        return [*found, *finder(scene, missing, params, bar)], ()


def _store(path: Path, scene: Scene, opacity: Mapping[Key, Image]) -> None:
    """Nothing is written of nothing."""
    if opacity:
        write_frames(path, (scene.height, scene.width, 1), ((*key, opacity[key]) for key in sorted(opacity)))


def _described(
    scene: Scene, found: Sequence[CutOut], opacity: Mapping[Key, Image], params: MatteParams
) -> dict[str, Any]:
    """mattes.json; `iou` is with true masks, of pictures that have one."""
    masks, known = scene.open_masks(), dict[Key, float]()
    for key in opacity:
        if masks is not None and key in masks:
            true, here = masks.image(*key) > 127, opacity[key] > 127
            union = int((true | here).sum())
            known[key] = round(int((true & here).sum()) / union, 5) if union else 1.0
    pictures = [
        {
            "camera": scene.cameras[one.camera].name,
            "frame": scene.frame_ids[one.frame],
            "source": one.source,
            "agreement": None if one.agreement is None else round(one.agreement, 5),
            "believed": one.believed,
            "iou": known.get((one.camera, one.frame)),
        }
        for one in found
    ]
    mean = round(float(np.mean(list(known.values()))), 5) if known else None
    return {"version": 1, "method": params.method, "train": params.train, "iou": mean, "pictures": pictures}
