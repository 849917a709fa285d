"""The contact sheet: size, content, and that it is not blank."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from facefolds_core.scoring.panels import METRICS, SUBJECT_METRICS, VARIANTS, ImageScore, Panel
from facefolds_core.scoring.sheets import (
    BLOCK_HEAD,
    CAPTION,
    FRAME_LABEL,
    GAP,
    MARGIN,
    TITLE,
    error_image,
    plan,
    write_contact_sheet,
)

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
def test_it_has_the_planned_size_and_is_not_blank(
    tmp_path: Path, cameras: int, frames: int, width: int, height: int
) -> None:
    panels = [panel(f"cam{i}", f"{k:06d}", width, height) for i in range(cameras) for k in range(frames)]
    write_contact_sheet(tmp_path / "sheet.png", "somebody", panels, averages())
    sheet = cv2.imread(str(tmp_path / "sheet.png"))
    layout = plan(width, height, cameras, frames)
    assert sheet.shape == (layout.size[1], layout.size[0], 3)
    assert sheet.std() > 10


def test_the_images_stand_where_the_headings_say(tmp_path: Path) -> None:
    write_contact_sheet(tmp_path / "sheet.png", "somebody", [panel("cam0", "000000", 40, 60)], averages())
    sheet = cv2.imread(str(tmp_path / "sheet.png"))[..., ::-1] / 255
    layout = plan(40, 60, 1, 1)
    row = TITLE + BLOCK_HEAD + layout.cell[1] // 2
    for column, colour in enumerate(COLOURS.values()):
        x = MARGIN + FRAME_LABEL + column * (layout.cell[0] + GAP) + layout.cell[0] // 2
        np.testing.assert_array_equal(sheet[row, x], colour)


def test_captions_under_narrow_pictures_do_not_meet(tmp_path: Path) -> None:
    one = panel("cam0", "000000", 128, 192)
    scores = [
        ImageScore(s.camera, s.frame, s.variant, s.values | {"psnr_over_plate": 29.19})
        for s in (one.model_score, one.asset_score)
    ]
    over = Panel("cam0", "000000", one.truth, one.model, one.asset, *scores)
    write_contact_sheet(tmp_path / "sheet.png", "somebody", [over], averages())
    sheet, layout = cv2.imread(str(tmp_path / "sheet.png")), plan(128, 192, 1, 1)
    top = TITLE + BLOCK_HEAD + layout.cell[1]
    gaps = [MARGIN + FRAME_LABEL + column * (layout.cell[0] + GAP) - GAP for column in (2, 3)]
    for gap in gaps:
        assert np.ptp(sheet[top + 2 : top + CAPTION - 2, gap : gap + GAP]) == 0


def test_images_keep_their_aspect_and_two_portrait_cameras_stand_side_by_side() -> None:
    layout = plan(128, 192, 2, 3)
    assert layout.cell[0] / layout.cell[1] == pytest.approx(128 / 192, abs=0.01)
    assert layout.across == 2


def test_captures_without_masks_have_a_sheet_too(tmp_path: Path) -> None:
    write_contact_sheet(tmp_path / "sheet.png", "s", [panel("cam0", "0", 32, 32, subject=None)], averages(None))
    assert (tmp_path / "sheet.png").stat().st_size > 1000


def test_no_error_is_dark_and_a_large_one_is_bright() -> None:
    truth = np.zeros((4, 4, 3))
    dark, none = error_image(truth, truth)
    bright, one = error_image(truth + 1, truth)
    assert (none, one) == (0, 1)
    assert dark.mean() < 0.05
    assert bright.mean() > 0.8
