"""data/SUBJECT/subject: who stands where, to look at, to correct, to train and to score with.

- `gaussians.npz`: the subject in one frame (storage.py);
- `sheet.png`: cut-outs over green, those first that contradict the others, in red frames;
- `CAMERA/FRAME.png`: each matte that was found or named, white is the subject;
- `mattes.arrow`: these and the capture's own, for the stages (`frame_store.FrameStore`, one channel);
- `mattes.json`: of each picture whence its matte is, and how well it agrees with the others and with true masks.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image as Pillow

from facefolds_core.captures.found_scene import GAUSSIANS, MATTES
from facefolds_core.captures.given_mattes import given_mattes
from facefolds_core.captures.place import contact_sheet
from facefolds_core.captures.scene import Scene
from facefolds_core.files.frame_store import Image, write_frames
from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.params import SubjectParams
from facefolds_core.progress import progress
from facefolds_core.spacing import spread
from facefolds_core.subject.cut_out import agreement
from facefolds_core.subject.find import find_subject
from facefolds_core.subject.mattes import Key, Matte, Mattes
from facefolds_core.subject.storage import FoundSubject, write_found

Told = dict[str, Any]
"""What mattes.json says of a picture: `camera`, `frame`, `source`, `agreement`, and `iou` with the true mask."""

GREEN, RED, WHITE = (90, 200, 90), (230, 40, 40), (255, 255, 255)
"""RGB: behind the subject, around what contradicts the others, of names."""
SIDE = 240
"""Longer side of a picture, pixels."""
MOST = 60
"""Pictures on the sheet, spread evenly."""


def make_folder(
    scene: Scene, folder: Path, params: SubjectParams, named: Path | None = None, start: Path | None = None
) -> tuple[FoundSubject, list[Told]]:
    """Write the folder, whole or not at all.

    Args:
        named: folder of mattes that the user has corrected, or None.
        start: PLY of Gaussians in place of our own fit, or None.
    """
    by_hand = {} if named is None else {(c, k): image for c, k, image in given_mattes(named, scene)}
    found, mattes = find_subject(scene, params, by_hand, start)
    with atomic_folder(folder) as temporary:
        write_found(temporary / GAUSSIANS, found)
        told, tiles = list[Told](), dict[Key, Image]()
        rows = _rows(scene, mattes, temporary, told, tiles)
        write_frames(temporary / MATTES, (scene.height, scene.width, 1), rows)
        Pillow.fromarray(contact_sheet(list(tiles.values()))).save(temporary / "sheet.png")
        write_json(temporary / "mattes.json", _described(told, found))
    return found, told


def _rows(
    scene: Scene, mattes: Mattes, folder: Path, told: list[Told], tiles: dict[Key, Image]
) -> Iterator[tuple[int, int, Image]]:
    """Mattes of all pictures, but of held-out ones where they are not given, as others are; `told` and `tiles` grow
    with them."""
    store, masks = scene.open_frames(), scene.open_masks()
    keys = [key for key in sorted(store) if mattes.body is not None or mattes.known(key)]
    shown, doubtful = set(spread(keys, MOST)), list[Key]()
    with progress(total=len(keys), desc="mattes", unit="picture") as bar:
        for key, matte in mattes.each(keys):
            iou = None
            if masks is not None and key in masks:
                iou = agreement(matte.opacity > 127, masks.image(*key)[..., 0] > 127)
            camera, frame = scene.cameras[key[0]].name, scene.frame_ids[key[1]]
            entry = {"camera": camera, "frame": frame, "source": matte.source}
            told.append({**entry, "agreement": _rounded(matte.agreement), "iou": _rounded(iou)})
            if matte.source != "capture":
                place = folder / camera / f"{frame}.png"
                place.parent.mkdir(exist_ok=True)
                Pillow.fromarray(matte.opacity).save(place)
            doubtful += [key] if matte.source == "gaussians" else []
            if key in shown or matte.source == "gaussians":
                tiles[key] = tile(scene, key, store.image(*key), matte)
            yield (*key, matte.opacity[..., None])
            bar.update()
    ordered = [*doubtful, *(key for key in sorted(shown) if key not in doubtful)][:MOST]
    kept = {key: tiles[key] for key in ordered}
    tiles.clear()
    tiles.update(kept)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 5)


def _described(told: list[Told], found: FoundSubject) -> dict[str, Any]:
    """mattes.json."""
    known = [one["iou"] for one in told if one["iou"] is not None]
    mean = round(float(np.mean(known)), 5) if known else None
    start = {"gaussians": len(found.splats), "psnr": round(found.psnr, 3)}
    return {"version": 2, "start": start, "iou": mean, "pictures": told}


def tile(scene: Scene, key: Key, picture: Image, matte: Matte) -> Image:
    """(h, w, 3): the cut-out over green, with camera and frame; in a red frame where the picture was not believed."""
    height, width = picture.shape[:2]
    scale = SIDE / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    opacity = matte.opacity[..., None] / np.float32(255)
    image = (picture * opacity + np.array(GREEN) * (1 - opacity)).astype(np.uint8)
    canvas = np.ascontiguousarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    words = f"{scene.cameras[key[0]].name} {scene.frame_ids[key[1]]} {matte.source}"
    words += "" if matte.agreement is None else f" {matte.agreement:.2f}"
    cv2.putText(canvas, words, (4, size[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.33, WHITE, 1, cv2.LINE_AA)
    if matte.source == "gaussians":
        cv2.rectangle(canvas, (1, 1), (size[0] - 2, size[1] - 2), RED, 3)
    return np.asarray(canvas, np.uint8)
