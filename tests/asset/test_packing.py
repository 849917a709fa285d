"""Where textures lie in the picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from facefolds_core.asset.packing import (
    GUTTER,
    HARDWARE_SIDE,
    LARGE_SIDE,
    MIN_SIDE,
    MIP_LEVELS,
    AtlasLayout,
    check_layout,
    fill_cell,
)
from facefolds_core.asset.video import pack_frame, unpack_picture
from facefolds_core.errors import UserError
from tests.assets import cap_textures

SIZES = {
    "one": [(40, 25)],
    "equal": [(56, 56)] * 12,
    "narrow": [(9, 200), (200, 9), (31, 33)],
    "many": [(20 + 7 * (i % 9), 90 - 11 * (i % 5)) for i in range(64)],
}


@pytest.mark.parametrize("sizes", SIZES.values(), ids=SIZES)
def test_layout_has_no_problems(sizes: list[tuple[int, int]]) -> None:
    layout = AtlasLayout.pack(sizes)
    assert layout.problems() == []
    assert [rect[2:] for rect in layout.rects] == sizes
    assert layout.width % 16 == layout.colour_rect[3] % 16 == 0
    assert min(layout.width, layout.height) >= MIN_SIDE


def test_shapes_that_decoders_take() -> None:
    assert AtlasLayout.pack([(512, 512)] * 12).long_side <= HARDWARE_SIDE
    assert AtlasLayout.pack([(1064, 552)] * 8).long_side <= HARDWARE_SIDE  # where fewer pixels would have a longer side
    small = AtlasLayout.pack([(56, 56)] * 12)
    assert small.pixels == 2 * 12 * 64**2 and small.long_side <= 512  # nothing is wasted
    check_layout(AtlasLayout.pack([(1024, 1024)] * 12), 1024)  # the paper's
    # One column of these has the least area, and no encoder takes it.
    cropped = AtlasLayout.pack([(1024, 1024)] * 5 + [(1024, 1008)] * 7)
    assert cropped.long_side <= LARGE_SIDE
    check_layout(cropped, 1024)


@pytest.mark.parametrize("sizes", SIZES.values(), ids=SIZES)
def test_mip_maps_do_not_mix_layers(sizes: list[tuple[int, int]]) -> None:
    """Bilinear look-ups in the box-filtered levels, at the corners of each clamped rectangle, see this layer only."""
    layout = AtlasLayout.pack(sizes)
    textures = [np.full((h, w, 1), 3 * i + 1, np.uint8) for i, (w, h) in enumerate(sizes)]
    image = np.zeros((layout.colour_rect[3], layout.width))
    for i, ((x, y, _, _), texture) in enumerate(zip(layout.rects, textures, strict=True)):
        cell = fill_cell(texture)[..., 0]
        image[y - GUTTER : y - GUTTER + cell.shape[0], x - GUTTER : x - GUTTER + cell.shape[1]] = 3 * i + 1
    for level in range(1, MIP_LEVELS + 1):
        n = 2**level
        small = image.reshape(image.shape[0] // n, n, image.shape[1] // n, n).mean((1, 3))
        for i, (x, y, w, h) in enumerate(layout.rects):
            for px in (x + 0.5, x + w - 0.5):
                for py in (y + 0.5, y + h - 0.5):
                    j, k = int(np.floor(px / n - 0.5)), int(np.floor(py / n - 0.5))
                    assert (small[k : k + 2, j : j + 2] == 3 * i + 1).all(), (level, i)


def grey(side: int) -> np.ndarray:
    """(3, side, side, 4) noise."""
    luma, alpha = np.random.default_rng(0).integers(0, 256, (2, 3, side, side, 1), dtype=np.uint8)
    return np.concatenate([luma, luma, luma, alpha], -1)


def plain(side: int) -> np.ndarray:
    """(4, side, side, 4), each of one colour that is far from its neighbours'."""
    colours = np.array([[255, 0, 0, 255], [0, 255, 0, 0], [0, 0, 255, 255], [255, 255, 0, 0]], np.uint8)
    return np.broadcast_to(colours[:, None, None], (4, side, side, 4))


@pytest.mark.parametrize("textures", [grey(37), grey(60), grey(64), plain(37), plain(64)], ids=lambda x: str(x.shape))
def test_round_trip_is_within_rounding_and_neighbours_do_not_leak(textures: np.ndarray) -> None:
    layout = AtlasLayout.pack([textures.shape[1:3]] * len(textures))
    back = np.stack(unpack_picture(pack_frame(list(textures), layout), layout))
    assert np.abs(back.astype(int) - textures).max() <= 2


def test_neighbours_do_not_leak_into_chroma_placed_otherwise() -> None:
    # A player that takes chroma for sited left reads half a pixel to the side: still within the gutter.
    textures = cap_textures(3, 0, 64)
    layout = AtlasLayout.pack([(64, 64)] * 3)
    picture = pack_frame(list(textures), layout)
    cb = picture[layout.height :].reshape(2, layout.height // 2, layout.width // 2)[0]
    for x, y, w, h in layout.rects:
        inside = cb[y // 2 : (y + h) // 2, x // 2 : (x + w) // 2]
        around = cb[y // 2 - 1 : (y + h) // 2 + 1, x // 2 - 1 : (x + w) // 2 + 1]
        assert around.min() >= inside.min() - 4 and around.max() <= inside.max() + 4


def test_too_large_a_picture_names_the_resolution_that_fits() -> None:
    with pytest.raises(UserError, match="do not fit") as caught:
        check_layout(AtlasLayout.pack([(2048, 2048)] * 12), 2048)
    named = int(str(caught.value.remedy).split(" to ")[1].split()[0])
    assert named > 1024 and AtlasLayout.pack([(named, named)] * 12).fits()


def test_problems_are_found() -> None:
    good = AtlasLayout.pack([(64, 64)] * 2)
    x, y, w, h = good.rects[1]
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"colour_rect": (0, 0, good.width, good.height + 2)}, "inside"),
        ({"alpha_rect": good.colour_rect}, "overlap"),
        ({"rects": (good.rects[0],) * 2}, "overlap"),
        ({"rects": (good.rects[0], (x + 64, y, w, h))}, "not inside"),
    ]
    for changes, word in wrong:
        assert any(word in problem for problem in replace(good, **changes).problems())
