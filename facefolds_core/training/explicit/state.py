"""Texture grids while they are trained: values and Adam's moments."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import ndimage
from torch import Tensor

from facefolds_core.kernels.adam import corrections, decays
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit import adam_kernel, shading_kernel
from facefolds_core.training.explicit.rates import BETAS
from facefolds_core.training.explicit.reflection_kernel import look
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.views import Views

FAINT = 1 / 255
"""Opacity of a code of a picture: less than that can be left out."""

UNSEEN_LOGIT = -9.0
"""Of texels that show nothing. `adam_kernel` keeps logits within 9 of 0."""

MIN_OPACITY, MAX_OPACITY = 0.003, 0.995
"""Bounds of a layer's opacity at the start: a logit can return from there within a level."""

BELIEF = 0.01
"""Share of the way back to the opacity of the Gaussians that each step goes. What few cameras see of a texel is noise:
on cameras left out, any background and inside, actor with 8 cameras +0.6 and +0.2 dB, with 20 cameras 0 and 0."""

MIN_LIGHT = 0.002
"""Layers behind less transmittance are skipped: speed, half a code of a pixel."""

MIN_ALPHA = 0.002
"""Layers with less alpha are skipped once the textures are at half resolution: speed, half a code of a pixel."""

PATCH_OPACITY = 0.3
"""Patches of texels that are more opaque, in any frame, are compared by size."""

LEAST_SHARE = 0.02
"""Of the largest patch: smaller ones go."""

REACH = 3
"""Width of the soft edge around patches that stay, texels."""


def model_bytes(texels: tuple[int, int], layers: int, frames: int) -> int:
    """Of the textures of a model with all its layers: float32, colour and alpha of the layers and of each frame."""
    return 4 * texels[0] * texels[1] * (3 + 4 * layers + frames * (3 + layers))


class TextureState:
    """Grids of `GridTextures` flattened to M = H W texels, each stacked with its two moments.

    Attributes:
        shape: (H, W).
        colour [3, M, 3], layers [3, M, N, 4], frame_colour [3, K, M, 3], frame_alpha [3, K, M, N].
        params: of the training.
        shine: (P, 3) what the reflection adds to each ray of the views; (0, 3) where there is none.
        steps: [K] Adam steps on each frame since the grids last grew; their sum is the static part's.
        believed: [M, N] logits of alpha at the start, which steps draw the static ones to; None draws nowhere.

    Args:
        start: [rows, columns, 3] colour at the start, over the window with its borders at the first and last rows and
            columns.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        layers: int,
        frames: int,
        start: Tensor,
        params: ExplicitParams,
    ) -> None:
        m = shape[0] * shape[1]
        self.params = params
        self.shape = shape
        self.colour = torch.zeros(3, m, 3)
        self.layers = torch.zeros(3, m, layers, 4)
        self.frame_colour = torch.zeros(3, frames, m, 3)
        self.frame_alpha = torch.zeros(3, frames, m, layers)
        image = start.permute(2, 0, 1)[None]
        image = torch.nn.functional.interpolate(image, size=shape, mode="bilinear", align_corners=False)
        self.colour[0] = image[0].permute(1, 2, 0).reshape(-1, 3)
        self.shine = np.zeros((0, 3), np.float32)
        self.believed: Tensor | None = None
        self._allocate()

    def _allocate(self) -> None:
        m, n = self.layers.shape[1:3]
        self.steps = np.zeros(self.frame_colour.shape[1], np.int64)
        self.texture = torch.empty(m, n, 4)
        self.gradient = torch.zeros(n, m, 4)

    def fill(self, opacity: NDArray[np.float32], rgb: NDArray[np.float32] | None = None) -> None:
        """Begin with this opacity (M, N) of the layers, and colours (M, N, 3) of their own; None keeps those that were
        learnt, for layers that have moved."""
        self.layers[1:] = 0
        self.layers[0, ..., 3] = _logits(opacity)
        self.frame_alpha.zero_()
        if rgb is not None:
            own = torch.from_numpy(rgb) - self.colour[0][:, None]
            self.layers[0, ..., :3] = torch.where(torch.from_numpy(opacity)[..., None] > MIN_OPACITY, own, 0.0)

    def fill_frame(self, frame: int, opacity: NDArray[np.float32], rgb: NDArray[np.float32] | None = None) -> None:
        """Begin one frame with an opacity (M, N) of its own, and with colours (M, N, 3), as far as one change of all
        layers' colours brings them; None keeps what it has."""
        self.frame_alpha[0, frame] = _logits(opacity) - self.layers[0, ..., 3]
        if rgb is not None:
            weight = torch.from_numpy(opacity)[..., None]
            change = torch.from_numpy(rgb) - self.colour[0][:, None] - self.layers[0, ..., :3]
            self.frame_colour[0, frame] = (weight * change).sum(1) / weight.sum(1).clamp(min=MIN_OPACITY)

    def believe(self, opacity: NDArray[np.float32]) -> None:
        """Keep the layers' opacity near this, (M, N), where pictures say little."""
        self.believed = _logits(opacity)

    def grow(self, shape: tuple[int, int]) -> None:
        """Resample all values to H x W texels (bilinear) and start the moments afresh."""
        old = self.shape
        self.shape = shape
        self.colour = _resample(self.colour[:1], old, shape)
        self.layers = _resample(self.layers[:1], old, shape)
        self.frame_colour = _resample(self.frame_colour[0], old, shape)
        self.frame_alpha = _resample(self.frame_alpha[0], old, shape)
        self.colour, self.layers = (_with_moments(x[0]) for x in (self.colour, self.layers))
        self.frame_colour, self.frame_alpha = (_with_moments(x) for x in (self.frame_colour, self.frame_alpha))
        self._allocate()

    def activated(self, frame: int) -> Tensor:
        """[M, N, 4] of one frame."""
        parts = (self.colour[0], self.layers[0], self.frame_colour[0, frame], self.frame_alpha[0, frame])
        adam_kernel.activate(*(part.numpy() for part in parts), self.texture.numpy())
        return self.texture

    def step(
        self,
        views: Views,
        rays: NDArray[np.int64],
        pictures: CutOuts,
        frame: int,
        min_alpha: float,
        rates: NDArray[np.float32],
    ) -> float:
        """One step on rays of one frame: shade, differentiate, update. Returns the mean squared error before it.

        Args:
            min_alpha: layers with less are skipped.
        """
        self.steps[frame] += 1
        static, own = corrections(BETAS, int(self.steps.sum())), corrections(BETAS, int(self.steps[frame]))
        texture = self.activated(frame)
        (h, w), n = self.shape, texture.shape[1]
        squares: float = shading_kernel.shade(
            *views.arrays,
            rays,
            pictures.cut(frame),
            pictures.behind,
            texture.numpy().reshape(h, w, n, 4),
            self.shine,
            self.gradient.numpy().reshape(n, h, w, 4),
            min_alpha,
            MIN_LIGHT,
            False,
        )
        adam_kernel.adam_step(
            self.colour.numpy(),
            self.layers.numpy(),
            self.frame_colour[:, frame].numpy(),
            self.frame_alpha[:, frame].numpy(),
            texture.numpy(),
            self.gradient.numpy(),
            rates,
            np.array([*static, *own], np.float32),
            decays(BETAS),
        )
        if self.believed is not None:
            self.layers[0, ..., 3].lerp_(self.believed, BELIEF)
        return squares / (3 * len(rays))

    def smooth_alpha(self, frame: int) -> None:
        """Replace the logits of alpha, static and of one frame, by their means over 3 x 3 texels; moments stay."""
        self._smooth(self.layers[0, ..., 3])
        self.smooth_frame(frame)

    def smooth_frame(self, frame: int) -> None:
        """The same of one frame alone."""
        self._smooth(self.frame_alpha[0, frame])

    def _smooth(self, logits: Tensor) -> None:
        logits.copy_(torch.from_numpy(adam_kernel.smooth(np.ascontiguousarray(logits.numpy()), *self.shape)))

    def look(self, views: Views, pictures: CutOuts, frame: int, seen: NDArray[np.float32]) -> None:
        """Add what the rays show in one frame, without reflections, to `seen` (P, 6): see `reflection_kernel.look`."""
        (h, w), n = self.shape, self.layers.shape[2]
        texture = self.activated(frame).numpy().reshape(h, w, n, 4)
        cut, behind = pictures.cut(frame), pictures.behind
        look(views.codes, views.camera, views.pixel, cut, behind, texture, seen, MIN_LIGHT)

    def clear(self) -> None:
        """Make texels transparent that stay under `FAINT` in all frames, and what is `loose`. What no ray has met is as
        opaque as it began, `MIN_OPACITY`, in all layers: a veil over white."""
        most = self.layers[0, ..., 3] + self.frame_alpha[0].amax(0)
        light = torch.stack([(1 - self.activated(k)[..., 3]).prod(1) for k in range(len(self.steps))]).amin(0)
        apart = torch.from_numpy(loose(1 - light.view(self.shape).numpy()).reshape(-1, 1))
        gone = (most < math.log(FAINT / (1 - FAINT))) | apart
        self.layers[0, ..., 3] = torch.where(gone, UNSEEN_LOGIT, self.layers[0, ..., 3])
        self.frame_alpha[0] = torch.where(gone, 0.0, self.frame_alpha[0])

    def forget_moments(self) -> None:
        """Give their memory back, two thirds of the grids'; no `step` can follow."""
        self.colour, self.layers = self.colour[:1].clone(), self.layers[:1].clone()
        self.frame_colour, self.frame_alpha = self.frame_colour[:1].clone(), self.frame_alpha[:1].clone()


def _logits(opacity: NDArray[np.float32]) -> Tensor:
    return torch.logit(torch.from_numpy(opacity).clamp(MIN_OPACITY, MAX_OPACITY))


def _with_moments(values: Tensor) -> Tensor:
    return torch.cat([values[None], values.new_zeros(2, *values.shape)])


@contextmanager
def on_one_thread() -> Iterator[None]:
    """torch rounds the ends of what a thread gets differently: on one thread the result is that of any number."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _resample(values: Tensor, old: tuple[int, int], new: tuple[int, int]) -> Tensor:
    """[B, M, ...] on one grid -> the same on another, bilinear between texel centres."""
    rest = values.shape[2:]
    image = values.reshape(len(values), *old, -1).permute(0, 3, 1, 2)
    with on_one_thread():
        image = torch.nn.functional.interpolate(image, size=new, mode="bilinear", align_corners=False)
    return image.permute(0, 2, 3, 1).reshape(len(values), -1, *rest).contiguous()


def loose(opacity: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Where nothing is near a large patch of opacity: rests of the room, or of the subject where one camera saw it.
    From another side such places are splinters in the air, or fog.

    Args:
        opacity: (H, W) of all layers together, the most over all frames.

    Returns:
        (H, W) bool; nowhere if there is no opacity at all.
    """
    labels, count = ndimage.label(opacity > PATCH_OPACITY, np.ones((3, 3)))
    if not count:
        return np.zeros(opacity.shape, bool)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    large = sizes >= LEAST_SHARE * sizes.max()
    return np.asarray(~ndimage.maximum_filter(large[labels], 2 * REACH + 1))
