"""The contact sheet, of any number of cameras and frames; photo beside asset, what is worst in a frame."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from facefolds_core.scoring.backgrounds import Patch, WorstPatch
from facefolds_core.scoring.panels import METRICS, SUBJECT_METRICS, VARIANTS, ImageScore, Panel
from facefolds_core.scoring.pictures import error_image, write_contact_sheet, write_worst

COLOURS = {"truth": (1.0, 0.0, 0.0), "model": (0.0, 1.0, 0.0), "asset": (0.0, 0.0, 1.0)}


def panel(camera: str, frame: str, width: int, height: int, subject: float | None = 21.0) -> Panel:
    values = dict.fromkeys((*METRICS, *SUBJECT_METRICS)) | {"psnr": 25.0, "psnr_subject": subject}
    images = [np.broadcast_to(colour, (height, width, 3)).astype(float) for colour in COLOURS.values()]
    return Panel(camera, frame, *images, *(ImageScore(camera, frame, v, values) for v in ("model", "asset")))


def averages(subject: float | None = 21.0) -> dict[str, object]:
    return {v: {"psnr": 25.0, "psnr_subject": subject} for v in VARIANTS}


@pytest.mark.parametrize(
    ("cameras", "frames", "width", "height"), [(1, 1, 128, 192), (2, 3, 128, 192), (5, 1, 768, 432), (3, 2, 20, 20)]
)
@pytest.mark.parametrize("subject", [21.0, None])
def test_it_shows_all_pictures_in_order(
    tmp_path: Path, cameras: int, frames: int, width: int, height: int, subject: float | None
) -> None:
    panels = [panel(f"cam{i}", f"{k:06d}", width, height, subject) for i in range(cameras) for k in range(frames)]
    write_contact_sheet(tmp_path / "sheet.png", "somebody", panels, averages(subject))
    sheet = cv2.imread(str(tmp_path / "sheet.png"))[..., ::-1]
    places = []
    for colour in COLOURS.values():
        count, _, boxes, middles = cv2.connectedComponentsWithStats(
            (sheet == 255 * np.array(colour)).all(2).astype("u1")
        )
        large = [k for k in range(1, count) if boxes[k, cv2.CC_STAT_AREA] > 1000]
        assert len(large) == cameras * frames
        assert boxes[large[0], 2] / boxes[large[0], 3] == pytest.approx(width / height, rel=0.05)
        places.append(middles[large])
    truth, model, asset = (np.array(sorted(of.tolist(), key=lambda at: (round(at[1] / 20), at[0]))) for of in places)
    assert (truth[:, 0] < model[:, 0]).all() and (model[:, 0] < asset[:, 0]).all()


def test_no_error_is_dark_and_a_large_one_is_bright() -> None:
    truth = np.zeros((4, 4, 3))
    dark, none = error_image(truth, truth)
    bright, one = error_image(truth + 1, truth)
    assert (none, one) == (0, 1)
    assert dark.mean() < 0.05
    assert bright.mean() > 0.8


PHOTO, ASSET = np.full((8, 6, 3), 51 / 255), np.full((8, 6, 3), 102 / 255)


@pytest.mark.parametrize("framed", [True, False])
def test_the_worst_is_photo_beside_asset(tmp_path: Path, framed: bool) -> None:
    score = ImageScore("a", "0", "asset", {"psnr": 20.0})
    panel = Panel("a", "0", PHOTO, ASSET, ASSET, score, score)
    patch = WorstPatch("a", "0", Patch(row=12, column=21, side=4, psnr=9.0), PHOTO, ASSET, (10, 20))
    write_worst(tmp_path / "worst.png", panel, patch if framed else None)
    found = np.asarray(Image.open(tmp_path / "worst.png"))
    assert found.shape == (8, 12, 3)
    white = (found == 255).all(-1)
    assert (np.unique(found[:, :6]).tolist(), np.unique(found[:, 6:]).tolist()) == (
        ([51, 255], [102, 255]) if framed else ([51], [102])
    )
    expected = np.zeros((8, 6), bool)
    expected[2:6, 1:5] = True
    expected[3:5, 2:4] = False
    assert not framed or (white == np.hstack([expected, expected])).all()
    assert (PHOTO == 51 / 255).all()
