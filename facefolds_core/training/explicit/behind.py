"""What may stand behind the subject in a picture: what is seen beside it, drawn on below it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Image = NDArray[np.float32]


def filled_in(
    pictures: NDArray[np.uint8],
    camera: NDArray[np.integer],
    pixel: NDArray[np.integer],
    opaque: NDArray[np.bool_],
    size: tuple[int, int],
) -> Image:
    """(C, H W, 3) in [0, 1]: pictures where rays find the layers transparent, `fill`ed in elsewhere; infinite where
    they are nowhere. What no ray reaches is not known to be room: below the layers' window the subject goes on.

    Args:
        pictures: (C, H W, 3), of one frame.
        camera, pixel: (P,) of rays of it, of any share of all pixels.
        opaque: (P,) whether layers are to be seen there.
        size: H, W.
    """
    filled = np.empty(pictures.shape, np.float32)
    for position, flat in enumerate(pictures):
        mine = camera == position
        clear = np.zeros(size, bool)
        clear.reshape(-1)[pixel[mine]] = True
        clear &= ~covered(pixel[mine], opaque[mine], size)
        if clear.any():
            filled[position] = fill(flat.reshape(*size, 3).astype(np.float32) / 255, clear).reshape(-1, 3)
        else:
            filled[position] = np.inf
    return filled


def covered(pixel: NDArray[np.integer], opaque: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    """(H, W): pixels within 2 of one that is opaque; along a row as far as pixels (P,) that are known lie apart.

    What lies beside is blurred into an edge; pixels that are not known may be opaque as well.
    """
    seen = np.zeros(size, bool)
    seen.reshape(-1)[pixel[opaque]] = True
    apart = int(np.diff(np.sort(pixel)).min()) if len(pixel) > 1 else 1
    near: NDArray[np.bool_] = ndimage.maximum_filter(seen, (5, 2 * max(2, apart) + 1))
    return near


def fill(image: Image, known: NDArray[np.bool_]) -> Image:
    """An image whose unknown pixels have what surrounds them, the smoother the farther away it is; 0 if none is known.

    Push-pull (Gortler et al., The Lumigraph, 1996): means of what is known in ever larger squares; what is unknown
    takes what the next larger ones say.

    Args:
        image: (H, W, 3).
        known: (H, W).
    """
    weight = known.astype(np.float32)
    return _pull(image * weight[..., None], weight)


def _pull(summed: Image, weight: Image) -> Image:
    """Means (H, W, 3) of `summed`, weighted by `weight` (H, W) in [0, 1]."""
    h, w = weight.shape
    mean = (summed / np.maximum(weight, 1e-6)[..., None]).astype(np.float32)
    if h == w == 1 or weight.min() >= 1:
        return mean
    half = max(1, w // 2), max(1, h // 2)
    coarse = _pull(_smaller(summed, half), _smaller(weight, half))
    rest = cv2.resize(coarse, (w, h), interpolation=cv2.INTER_LINEAR).reshape(h, w, 3)
    share = weight[..., None]
    return (share * mean + (1 - share) * rest).astype(np.float32)


def _smaller(array: Image, size: tuple[int, int]) -> Image:
    """To width and height `size`, by means."""
    return cv2.resize(array, size, interpolation=cv2.INTER_AREA).astype(np.float32)
