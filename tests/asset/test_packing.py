"""Where textures lie in the picture."""

from __future__ import annotations

import numpy as np
import pytest

from facefolds_core.asset.packing import AtlasLayout, check_layout
from facefolds_core.asset.video import pack_frame, unpack_picture
from facefolds_core.errors import UserError
from tests.assets import cap_textures


@pytest.mark.parametrize(
    ("layers", "grid"), [(1, (1, 1)), (2, (2, 1)), (3, (2, 2)), (5, (3, 2)), (9, (3, 3)), (12, (4, 3)), (64, (8, 8))]
)
def test_grid_is_nearly_square(layers: int, grid: tuple[int, int]) -> None:
    layout = AtlasLayout.grid(layers, 60)
    assert layout.colour_rect == (0, 0, 64 * grid[0], 64 * grid[1])


@pytest.mark.parametrize("layers", [1, 3, 12])
@pytest.mark.parametrize("resolution", [8, 37, 60, 64])
def test_layout_has_no_problems(layers: int, resolution: int) -> None:
    layout = AtlasLayout.grid(layers, resolution)
    assert layout.problems() == []
    assert layout.width % 16 == 0 and layout.colour_rect[3] % 16 == 0


@pytest.mark.parametrize("resolution", [37, 60, 64])
def test_round_trip_of_grey_is_within_rounding(resolution: int) -> None:
    rng = np.random.default_rng(0)
    grey = rng.integers(0, 256, (3, resolution, resolution, 1), dtype=np.uint8)
    alpha = rng.integers(0, 256, grey.shape, dtype=np.uint8)
    textures = np.concatenate([grey, grey, grey, alpha], -1)
    layout = AtlasLayout.grid(3, resolution)
    back = unpack_picture(pack_frame(textures, layout), layout)
    assert np.abs(back.astype(int) - textures).max() <= 2


@pytest.mark.parametrize("resolution", [37, 64])
def test_neighbours_do_not_leak(resolution: int) -> None:
    colours = np.array([[255, 0, 0, 255], [0, 255, 0, 0], [0, 0, 255, 255], [255, 255, 0, 0]], np.uint8)
    textures = np.broadcast_to(colours[:, None, None], (4, resolution, resolution, 4))
    layout = AtlasLayout.grid(4, resolution)
    back = unpack_picture(pack_frame(textures, layout), layout)
    assert np.abs(back.astype(int) - textures).max() <= 2


def test_neighbours_do_not_leak_into_chroma_centred_across() -> None:
    # A player that takes chroma for centred reads half a pixel to the side: still within the gutter.
    textures = cap_textures(3, 0, 64)
    layout = AtlasLayout.grid(3, 64)
    picture = pack_frame(textures, layout)
    cb = picture[layout.height :].reshape(2, layout.height // 2, layout.width // 2)[0]
    for x, y, w, h in layout.rects:
        inside = cb[y // 2 : (y + h) // 2, x // 2 : (x + w) // 2]
        around = cb[y // 2 - 1 : (y + h) // 2 + 1, x // 2 - 1 : (x + w) // 2 + 1]
        assert around.min() >= inside.min() - 4 and around.max() <= inside.max() + 4


def test_paper_size_fits() -> None:
    check_layout(AtlasLayout.grid(12, 1024))


def test_too_large_a_picture_names_the_resolution_that_fits() -> None:
    with pytest.raises(UserError, match="do not fit") as caught:
        check_layout(AtlasLayout.grid(12, 2048))
    largest = int(str(caught.value.remedy).split(" to ")[1].split()[0])
    assert AtlasLayout.grid(12, largest).fits() and not AtlasLayout.grid(12, largest + 1).fits()


def test_problems_are_found() -> None:
    good = AtlasLayout.grid(2, 64)
    x, y, w, h = good.rects[1]
    moved = [
        (
            AtlasLayout(good.width, good.height, (0, 0, good.width, good.height + 2), good.alpha_rect, good.rects),
            "inside",
        ),
        (AtlasLayout(good.width, good.height, good.colour_rect, good.colour_rect, good.rects), "overlap"),
        (AtlasLayout(good.width, good.height, good.colour_rect, good.alpha_rect, (good.rects[0],) * 2), "overlap"),
        (
            AtlasLayout(good.width, good.height, good.colour_rect, good.alpha_rect, (good.rects[0], (x + 64, y, w, h))),
            "not inside",
        ),
    ]
    for layout, word in moved:
        assert any(word in problem for problem in layout.problems())
