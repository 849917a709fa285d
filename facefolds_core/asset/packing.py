"""Where the layers' textures lie in the video's picture.

The colour image holds one cell a layer, packed by rectangle-packer; the alpha image has the same cells below it. A cell
is the layer's rectangle and a gutter of GUTTER pixels on each side, rounded up to whole macroblocks (16) and placed on
multiples of 16; what the texture leaves of its cell repeats its border. So

- no block of the codec spans two layers, and interpolated chroma brings no neighbour's hue;
- texels of mip-map levels 1 to MIP_LEVELS (means of 2^m x 2^m pixels, m <= 4) belong to one cell each, and a bilinear
  look-up at a clamped (s, t), at least GUTTER + 1/2 >= 2^(m-1) pixels inside the cell, reads this cell only if m <= 3.

Pictures are multiples of 16 a side, at least MIN_SIDE, and at most HARDWARE_SIDE where the layers can be placed so:
beyond, many hardware decoders stop; if not, at most LARGE_SIDE, if not, MAX_SIDE. A reader takes the rectangles from
the manifest and does not care how they were chosen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError

MACROBLOCK = 16
GUTTER = 4
MIP_LEVELS = 3
MIN_SIDE = 128
"""Pixels a side that every hardware decoder takes (NVDEC's least for VP9 and AV1)."""
HARDWARE_SIDE = 4096
LARGE_SIDE = 8192
"""Pixels a side that new hardware, browsers and H.264's highest level take."""
MAX_PIXELS = 35_651_584
"""Pixels a picture at the highest levels: 6.2 of H.264 (139 264 macroblocks), of VP9 and 6.3 of AV1."""
MAX_SIDE = 16_384
"""Pixels a side that the encoders take."""
WIDTHS_TRIED = 24
HEIGHT_SLACK = (1.0, 1.1, 1.25, 1.5, 2.0, math.inf)
"""Heights tried, in those that the cells' area asks for at the width."""

Rect = tuple[int, int, int, int]
"""(x, y, width, height), pixels, from the top left corner."""


@dataclass(frozen=True)
class AtlasLayout:
    """Places of N textures in a picture.

    Attributes:
        width, height: of the picture, even.
        colour_rect, alpha_rect: of the two images in the picture, of one size, at even places.
        rects: of each layer within the colour image and, the same, within the alpha image.
        unit: cells and gutters are so many times as large as they need to be, for `scaled`.
    """

    width: int
    height: int
    colour_rect: Rect
    alpha_rect: Rect
    rects: tuple[Rect, ...]
    unit: int = 1

    @classmethod
    def pack(cls, sizes: Sequence[tuple[int, int]], unit: int = 1) -> AtlasLayout:
        """The layout that the writer uses for N textures of (width, height) texels, multiples of `unit`.

        Of the packings for WIDTHS_TRIED greatest widths, each as low as HEIGHT_SLACK allows, the one of least area
        among those of at most HARDWARE_SIDE a side, if there are any, else of LARGE_SIDE, else of MAX_SIDE; among
        equals the one with the shorter long side.
        """
        import rpack  # readers do not need it

        block = MACROBLOCK * unit
        cells = [(cell_size(width, unit) // block, cell_size(height, unit) // block) for width, height in sizes]
        narrow, wide = max(width for width, _ in cells), sum(width for width, _ in cells)
        widths = sorted({round(float(w)) for w in np.geomspace(narrow, wide, WIDTHS_TRIED)})
        area, tall = sum(width * height for width, height in cells), max(height for _, height in cells)
        layouts = []
        for width in widths:
            # Without a bound on the height equal cells end up in one column.
            for slack in HEIGHT_SLACK:
                bound = sum(h for _, h in cells) if math.isinf(slack) else max(tall, math.ceil(slack * area / width))
                try:
                    places = rpack.pack(cells, max_width=width, max_height=bound)
                except rpack.PackingImpossibleError:
                    continue
                layouts.append(cls._placed(sizes, cells, places, unit))
                break
        limits = (HARDWARE_SIDE, LARGE_SIDE, MAX_SIDE)
        return min(layouts, key=lambda it: (sum(it.long_side > side for side in limits), it.pixels, it.long_side))

    @classmethod
    def _placed(
        cls,
        sizes: Sequence[tuple[int, int]],
        cells: Sequence[tuple[int, int]],
        places: Sequence[tuple[int, int]],
        unit: int,
    ) -> AtlasLayout:
        block, gutter, least = MACROBLOCK * unit, GUTTER * unit, MIN_SIDE * unit
        columns = max(x + width for (x, _), (width, _) in zip(places, cells, strict=True))
        rows = max(y + height for (_, y), (_, height) in zip(places, cells, strict=True))
        width, height = max(columns * block, least), max(rows * block, least // 2)
        return cls(
            width=width,
            height=2 * height,
            colour_rect=(0, 0, width, height),
            alpha_rect=(0, height, width, height),
            rects=tuple(
                (x * block + gutter, y * block + gutter, w, h) for (x, y), (w, h) in zip(places, sizes, strict=True)
            ),
            unit=unit,
        )

    def scaled(self, factor: int) -> AtlasLayout:
        """The same layout with a `factor`-th of the pixels a side; `factor` divides the unit."""
        whole = [self.colour_rect, self.alpha_rect, *self.rects]
        colour, alpha, *layers = ((x // factor, y // factor, w // factor, h // factor) for x, y, w, h in whole)
        width, height, unit = self.width // factor, self.height // factor, self.unit // factor
        return AtlasLayout(width, height, colour, alpha, tuple(layers), unit)

    @property
    def pixels(self) -> int:
        return self.width * self.height

    @property
    def long_side(self) -> int:
        return max(self.width, self.height)

    def fits(self) -> bool:
        """Whether the codecs allow a picture of this size."""
        return self.pixels <= MAX_PIXELS and self.long_side <= MAX_SIDE

    def problems(self) -> list[str]:
        """What is wrong with the rectangles, in words; empty if nothing."""
        found = []
        size = (self.width, self.height)
        for name, rect in (("colour_rect", self.colour_rect), ("alpha_rect", self.alpha_rect)):
            if not inside(rect, size):
                found.append(f"{name} {list(rect)} is not inside the video of {size[0]} x {size[1]} pixels")
            if any(number % 2 for number in rect):
                found.append(f"{name} {list(rect)} has odd numbers")
        if self.colour_rect[2:] != self.alpha_rect[2:]:
            found.append(f"colour_rect {list(self.colour_rect)} and alpha_rect {list(self.alpha_rect)} differ in size")
        elif _overlap(self.colour_rect, self.alpha_rect):
            found.append("colour_rect and alpha_rect overlap")
        for index, rect in enumerate(self.rects):
            if not inside(rect, self.colour_rect[2:]):
                found.append(f"texture_rect {list(rect)} of layer {index} is not inside the colour image")
            found += [
                f"the texture_rects of layers {other} and {index} overlap"
                for other in range(index)
                if _overlap(rect, self.rects[other])
            ]
        return found


def cell_size(side: int, unit: int = 1) -> int:
    """Pixels along one side of the cell of a texture with `side` texels along it: whole macroblocks."""
    return -(-(side + 2 * GUTTER * unit) // (MACROBLOCK * unit)) * MACROBLOCK * unit


def fill_cell(texture: NDArray[np.uint8], unit: int = 1) -> NDArray[np.uint8]:
    """A texture (h, w, C) with its border repeated to fill its cell."""
    gutter = GUTTER * unit
    after = [cell_size(side, unit) - side - gutter for side in texture.shape[:2]]
    return np.pad(texture, ((gutter, after[0]), (gutter, after[1]), (0, 0)), mode="edge")


def check_layout(layout: AtlasLayout, resolution: int) -> None:
    """Refuse a picture that the codecs cannot hold; `resolution` is R^t, of which the rectangles are parts.

    Raises:
        UserError: naming an R^t that fits.
    """
    if layout.fits():
        return
    smaller = resolution
    while smaller > MACROBLOCK:
        smaller -= MACROBLOCK
        sizes = [(max(1, w * smaller // resolution), max(1, h * smaller // resolution)) for _, _, w, h in layout.rects]
        if AtlasLayout.pack(sizes).fits():
            break
    raise UserError(
        "the textures do not fit into one video",
        place=f"{len(layout.rects)} layers of {resolution} x {resolution} texels",
        expected=f"at most {MAX_SIDE} pixels a side and {MAX_PIXELS} in all",
        found=f"{layout.width} x {layout.height} pixels",
        remedy=f"set texture.resolution in params.yaml to {smaller} or less, or train fewer layers",
    )


def cut(image: NDArray[np.uint8], rects: Sequence[Rect]) -> tuple[NDArray[np.uint8], ...]:
    """Take the layers out of an image of the atlas: (H, W, C) -> N textures (h, w, C)."""
    return tuple(image[y : y + h, x : x + w] for x, y, w, h in rects)


def inside(rect: Rect, size: tuple[int, ...]) -> bool:
    """Whether a rectangle lies in an image of (width, height)."""
    x, y, width, height = rect
    return x + width <= size[0] and y + height <= size[1]


def _overlap(a: Rect, b: Rect) -> bool:
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]
