"""Error over any background, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.captures.cutout import foreground
from facefolds_core.scoring.backgrounds import Cutout, Rendering, find_patch, patch_side, squared_error, worst_patch
from facefolds_core.scoring.images import over_any
from facefolds_core.scoring.matte import opacity_errors

SIZE = 48


def disc(radius: float = 16.0) -> np.ndarray:
    """(SIZE, SIZE) opacity with a soft edge."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    return np.clip(radius - np.hypot(x, y), 0, 1)


def skin() -> np.ndarray:
    """(SIZE, SIZE, 3) straight colours, multiples of 1/255."""
    return np.random.default_rng(0).integers(60, 200, (SIZE, SIZE, 3)) / 255


def plate() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (SIZE, SIZE, 3)) / 255


def photo(opacity: np.ndarray, room: np.ndarray) -> np.ndarray:
    return opacity[..., None] * skin() + (1 - opacity)[..., None] * room


def test_the_plate_gives_the_subject_alone() -> None:
    cut = Cutout.of(photo(disc(), plate()), disc(), plate())
    np.testing.assert_allclose(cut.colour, disc()[..., None] * skin(), atol=1e-12)


def test_without_a_plate_half_covered_pixels_get_the_colours_beside_them() -> None:
    """Red before green: no green is left in the outline."""
    red, green = np.zeros((SIZE, SIZE, 3)), np.zeros((SIZE, SIZE, 3))
    red[..., 0], green[..., 1] = 0.8, 0.6
    opacity = disc()[..., None]
    found = foreground(opacity * red + (1 - opacity) * green, disc())
    edge = (disc() > 0.05) & (disc() < 0.95)
    assert edge.any()
    assert np.abs(found - red)[edge].max() < 0.05


@pytest.mark.parametrize("room", [None, plate()])
def test_the_truth_has_no_error_but_rounding(room: np.ndarray | None) -> None:
    cut = Cutout(disc()[..., None] * skin(), disc(), room)
    assert squared_error(cut.colour, disc(), cut).max() <= (0.5 / 255) ** 2 + 1e-12


def test_haze_costs_over_white_and_grey_what_it_does_not_over_black() -> None:
    """Black haze of opacity h where there is nothing: h over white, h / 2 over grey, none over black."""
    cut = Cutout(np.zeros((8, 8, 3)), np.zeros((8, 8)))
    found = squared_error(np.zeros((8, 8, 3)), np.full((8, 8), 0.4), cut)
    assert found == pytest.approx(np.full((8, 8), (0.4**2 + 0.2**2) / 3), abs=2e-3)


def test_a_hole_costs_whatever_is_behind_it() -> None:
    cut = Cutout(np.full((8, 8, 3), 0.5), np.ones((8, 8)))
    found = squared_error(np.zeros((8, 8, 3)), np.zeros((8, 8)), cut)
    assert found == pytest.approx(np.full((8, 8), (0.25 + 0.25 + 0) / 3), abs=2e-3)


def test_the_worst_patch_is_found_where_it_is() -> None:
    """What lies beside the subject is no patch of it; a patch is an eighth of it."""
    error = np.full((SIZE, SIZE), 1e-4)
    error[:8, :8] = 1
    beside = worst_patch(error, disc())
    error[20:28, 22:30] = 0.1
    found = worst_patch(error, disc())
    assert found is not None and beside is not None
    assert (found.row, found.column, found.side) == (20, 22, 8)
    assert (beside.psnr, found.psnr) == pytest.approx((40, 10))
    assert worst_patch(error, np.zeros((SIZE, SIZE))) is None
    assert patch_side(np.ones((160, 160))) == 20


def test_a_frozen_eye_is_the_worst_patch() -> None:
    """Crops show it with what is around it, truth and asset over the same grey."""
    cut = Cutout(disc()[..., None] * skin(), disc(), plate())
    wrong = cut.colour.copy()
    wrong[18:26, 30:38] = 0
    found = find_patch("A", "3", Rendering(wrong.astype(np.float32), disc().astype(np.float32)), cut)
    assert found is not None
    assert (found.place.row, found.place.column) == (18, 30)
    assert found.truth.shape == found.asset.shape == (24, 24, 3)
    inner = (slice(18 - found.corner[0], 26 - found.corner[0]), slice(30 - found.corner[1], 38 - found.corner[1]))
    assert np.abs(found.truth - found.asset)[inner].min() > 0.2


@pytest.mark.parametrize(("part", "where"), [("inside", 0.0), ("edge", 15.5), ("outside", 22.0)])
def test_opacity_is_judged_where_it_is_wrong(part: str, where: float) -> None:
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    wrong = np.abs(np.hypot(x, y) - where) < 1.5
    alpha = np.where(wrong, 1 - disc(), disc())
    found = opacity_errors(alpha, disc())
    assert {name for name, value in found.items() if value} == {f"opacity_{part}"}


def test_an_outline_that_is_too_thin_shows_in_all_of_them() -> None:
    cut = Cutout(disc()[..., None] * skin(), disc(), plate())
    same = over_any(Rendering(cut.colour.astype(np.float32), disc().astype(np.float32)), cut)
    thin = disc(0.9 * 16)
    found = over_any(Rendering((thin[..., None] * skin()).astype(np.float32), thin.astype(np.float32)), cut)
    assert same["psnr_any"] > found["psnr_any"] + 20  # type: ignore[operator]
    assert found["opacity_edge"] > 0.1 > 1e-3 > same["opacity_edge"]  # type: ignore[operator]
