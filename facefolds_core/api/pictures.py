"""Pictures as the API gives them, and which frames there are."""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import SupportsIndex

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError

Picture = NDArray[np.uint8]
"""(H, W, 4) RGBA with straight alpha, or (H, W, 3) RGB; sRGB, row 0 on top."""
Colour = Sequence[float]
"""RGB, 0 to 1."""


def picture(rgb: NDArray[np.float32], alpha: NDArray[np.float32], background: Colour | None) -> Picture:
    """What a renderer gives, as a picture.

    Args:
        rgb: (H, W, 3) over black.
        alpha: (H, W).
        background: what is shown behind; None leaves it transparent.

    Returns:
        (H, W, 4) without a background, else (H, W, 3).
    """
    if background is None:
        rgb = np.dstack([rgb / np.maximum(alpha, 1e-6)[..., None], alpha])
    else:
        rgb = rgb + (1 - alpha)[..., None] * np.asarray(background, np.float32)
    return np.asarray(np.rint(255 * rgb.clip(0, 1)), np.uint8)


def check_frame(frame: SupportsIndex, count: int, of: str) -> int:
    """The frame as a number, if there is such a frame.

    Args:
        count: how many there are.
        of: what has them, for the message.

    Raises:
        UserError: if there is none.
    """
    number = index(frame)
    if 0 <= number < count:
        return number
    raise UserError(
        "no such frame",
        place="frame",
        expected=f"0 to {count - 1}: {of} has {count} frame{'s' * (count > 1)}",
        found=number,
        remedy="name one of these",
    )
