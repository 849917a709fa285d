"""Where the layers' textures lie in the video's picture.

The colour image is a near-square grid of cells, filled by rows, the outermost layer first; the alpha image has the same
grid below it. A cell is R^t and a gutter of 2 pixels on each side, rounded up to whole macroblocks (16), so that no
block of the codec spans two layers; what the texture leaves of its cell repeats its border. The gutter is one chroma
sample wide: without it, interpolated chroma brings the neighbouring layer's hue into a texture's last column and rows
(off by up to 66 of 255 in the synthetic asset of the tests, before the codec; with the gutter 6).

A reader takes the rectangles from the manifest and does not care how they were chosen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError

MACROBLOCK = 16
GUTTER = 2
MAX_MACROBLOCKS = 139_264
"""Macroblocks a picture at level 6.2, the highest of H.264 (table A-1)."""
MAX_SIDE = 16_384
"""Pixels a side that libx264 takes."""

Rect = tuple[int, int, int, int]
"""(x, y, width, height), pixels, from the top left corner."""


@dataclass(frozen=True)
class AtlasLayout:
    """Places of N square textures of R x R texels in a picture.

    Attributes:
        width, height: of the picture, even.
        colour_rect, alpha_rect: of the two images in the picture, of one size, at even places.
        rects: of each layer within the colour image and, the same, within the alpha image; R x R.
    """

    width: int
    height: int
    colour_rect: Rect
    alpha_rect: Rect
    rects: tuple[Rect, ...]

    @classmethod
    def grid(cls, layers: int, resolution: int) -> AtlasLayout:
        """The layout that the writer uses for N layers of R x R texels."""
        columns = math.isqrt(layers - 1) + 1
        rows = -(-layers // columns)
        pitch = cell_size(resolution)
        width, height = columns * pitch, rows * pitch
        corners = [(column * pitch, row * pitch) for row in range(rows) for column in range(columns)]
        return cls(
            width=width,
            height=2 * height,
            colour_rect=(0, 0, width, height),
            alpha_rect=(0, height, width, height),
            rects=tuple((x + GUTTER, y + GUTTER, resolution, resolution) for x, y in corners[:layers]),
        )

    @property
    def resolution(self) -> int:
        return self.rects[0][2]

    def fits(self) -> bool:
        """Whether H.264 allows a picture of this size."""
        blocks = -(-self.width // MACROBLOCK) * -(-self.height // MACROBLOCK)
        return blocks <= MAX_MACROBLOCKS and max(self.width, self.height) <= MAX_SIDE

    def problems(self) -> list[str]:
        """What is wrong with the rectangles, in words; empty if nothing."""
        found = []
        size = (self.width, self.height)
        for name, rect in (("colour_rect", self.colour_rect), ("alpha_rect", self.alpha_rect)):
            if not _inside(rect, size):
                found.append(f"{name} {list(rect)} is not inside the video of {size[0]} x {size[1]} pixels")
            if any(number % 2 for number in rect):
                found.append(f"{name} {list(rect)} has odd numbers")
        if self.colour_rect[2:] != self.alpha_rect[2:]:
            found.append(f"colour_rect {list(self.colour_rect)} and alpha_rect {list(self.alpha_rect)} differ in size")
        elif _overlap(self.colour_rect, self.alpha_rect):
            found.append("colour_rect and alpha_rect overlap")
        for index, rect in enumerate(self.rects):
            if not _inside(rect, self.colour_rect[2:]):
                found.append(f"texture_rect {list(rect)} of layer {index} is not inside the colour image")
            if rect[2:] != (self.resolution, self.resolution):
                found.append(f"texture_rect {list(rect)} of layer {index} is not {self.resolution} pixels a side")
            found += [
                f"the texture_rects of layers {other} and {index} overlap"
                for other in range(index)
                if _overlap(rect, self.rects[other])
            ]
        return found


def cell_size(resolution: int) -> int:
    """Pixels a side of the cell of a texture: whole macroblocks."""
    return -(-(resolution + 2 * GUTTER) // MACROBLOCK) * MACROBLOCK


def fill_cell(texture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A texture (R, R, C) with its border repeated to fill its cell."""
    after = cell_size(len(texture)) - len(texture) - GUTTER
    return np.pad(texture, ((GUTTER, after), (GUTTER, after), (0, 0)), mode="edge")


def check_layout(layout: AtlasLayout) -> None:
    """Refuse a picture that H.264 cannot hold.

    Raises:
        UserError: naming the largest R^t that fits.
    """
    if layout.fits():
        return
    layers, largest = len(layout.rects), layout.resolution
    while largest > 1 and not AtlasLayout.grid(layers, largest).fits():
        largest -= 1
    raise UserError(
        "the textures do not fit into one H.264 video",
        place=f"{layers} layers of {layout.resolution} x {layout.resolution} texels",
        expected=f"at most {MAX_SIDE} pixels a side and {MAX_MACROBLOCKS * MACROBLOCK**2} in all (level 6.2)",
        found=f"{layout.width} x {layout.height} pixels",
        remedy=f"set texture.resolution in params.yaml to {largest} or less, or train fewer layers",
    )


def cut(image: NDArray[np.uint8], rects: tuple[Rect, ...]) -> NDArray[np.uint8]:
    """Take the layers out of an image of the atlas: (h, w, C) -> (N, R, R, C)."""
    return np.stack([image[y : y + h, x : x + w] for x, y, w, h in rects])


def _inside(rect: Rect, size: tuple[int, ...]) -> bool:
    x, y, width, height = rect
    return x + width <= size[0] and y + height <= size[1]


def _overlap(a: Rect, b: Rect) -> bool:
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]
