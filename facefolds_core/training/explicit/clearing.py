"""Texels that the finished model does without: what no ray shows, what lies beside the subject, splinters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import ndimage

from facefolds_core.facts import Fact, fact
from facefolds_core.params import ExplicitParams, PruningParams
from facefolds_core.spacing import spread
from facefolds_core.training.explicit.behind import filled_in
from facefolds_core.training.explicit.silhouettes import Silhouettes
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.views import Pictures, Rays, Views

Light = Callable[[TextureState, Views, int], None]
_LEARNT, _AROUND, _BESIDE = "learnt", "around", "beside"


def _as_it_is(state: TextureState, views: Views, frame: int) -> None:
    """`state.shine` is of the views."""


def clear_texels(
    state: TextureState,
    rays: Rays,
    images: Pictures,
    passes: int,
    params: ExplicitParams,
    outlines: Silhouettes | None = None,
    light: Light = _as_it_is,
    size: tuple[int, int] | None = None,
) -> list[Fact]:
    """Make them transparent; what is to be said of it.

    Args:
        rays: of the training cameras, looked at in `passes` parts.
        images: of the same.
        outlines: of the subject in some of them; None if nothing is known.
        light: sets `state.shine` to what is added to the rays of some views in a frame.
        size: H, W of pictures; None where nothing is to be asked of what is seen beside the layers.
    """
    least, found = params.pruning.texel_opacity, list[Fact]()
    hidden = state.contributions(rays, passes) < least
    hidden |= state.beside(params.start.beside_opacity)
    hidden |= painted_room(state, rays, images, passes, params.pruning, outlines, light, size)
    state.hide(hidden)
    apart, count = specks(_opacity(state), params.pruning)
    if count:
        splinters = torch.from_numpy(apart.reshape(-1, 1))
        state.hide(splinters.expand_as(hidden))
        hidden |= splinters
        found.append(fact("specks_cleared", count=count, share=params.pruning.speck_share))
    found.append(fact("texels_cleared", share=float(hidden.float().mean()), least=least))
    return found


def painted_room(
    state: TextureState,
    rays: Rays,
    images: Pictures,
    passes: int,
    params: PruningParams,
    outlines: Silhouettes | None = None,
    light: Light = _as_it_is,
    size: tuple[int, int] | None = None,
) -> torch.Tensor:
    """(M, 1) bool: texels in directions in which the subject shows hardly better than the bare background does.

    A layer that is as black as the room behind it costs nothing in any training picture, and hangs beside the head as a
    black wing before any other background. Of each ray |B - I|^2 - |C - I|^2, C what the layers show, lit, over the
    background B, counts where the ray's opacity lies, mean over `room_frames` and squares of `room_texels`. B is what
    was learnt, and it takes a gain of `room_gain`, or where rays lie beside the subject's `outlines` for the most part
    of `beside_gain`, to stay. Behind opaque layers nothing was learnt: before what pictures of `size` show beside the
    layers it takes `beside_layers_gain`. There one ray counts for `gain_limit` times what it takes, however much it
    gains: else the subject's gain outshines the wing beside it. Not before what was learnt: at the window's edge that
    is the subject itself, which goes on below, and what is near it stays.
    """
    least = {_LEARNT: params.room_gain, _BESIDE: params.beside_gain if outlines is not None else 0.0}
    least |= {_AROUND: params.beside_layers_gain if size is not None else 0.0}
    least = {name: gain for name, gain in least.items() if gain > 0}
    found = _poor(state, rays, images, passes, params, light, size, least) if least else {}
    if outlines is not None and _BESIDE in found:
        found[_BESIDE] &= _beside(state, rays, images, passes, outlines, light) < params.beside_share
    (h, w), side = state.shape, params.room_texels
    poor = np.any([np.zeros((-(-h // side), -(-w // side)), bool), *found.values()], 0)
    return torch.from_numpy(np.kron(poor, np.ones((side, side), bool))[:h, :w].reshape(-1, 1))


def _poor(
    state: TextureState,
    rays: Rays,
    images: Pictures,
    passes: int,
    params: PruningParams,
    light: Light,
    size: tuple[int, int] | None,
    least: Mapping[str, float],
) -> dict[str, NDArray[np.bool_]]:
    """Of each background of `least` the cells whose rays gain less than that on average, by their opacity."""
    mass, *cells = (_Cells(state.shape, params.room_texels) for _ in range(1 + len(least)))
    sums = dict(zip(least, cells, strict=True))
    background = state.background.cpu().numpy()
    for frame in spread(range(len(state.steps)), params.room_frames):
        picture = images.frame(frame)
        seen, camera, pixel = _look(state, rays, picture, passes, frame, light)
        image, shown = picture[camera, pixel].astype(np.float32) / 255, (seen[:, :3] ** 2).mean(1)
        bare = ((image - background[camera, pixel]) ** 2).mean(1)
        gains = {_LEARNT: bare - shown, _BESIDE: bare - shown}
        if size is not None and _AROUND in least:
            beside = filled_in(picture, camera, pixel, seen[:, 3] > params.beside_layers_opacity, size)
            around = ((image - beside[camera, pixel]) ** 2).mean(1) - shown
            limit = params.gain_limit * least[_AROUND]
            gains[_AROUND] = np.clip(around, -limit, limit)
        mass.add(seen, np.ones(len(seen)))
        for name, one in sums.items():
            one.add(seen, gains[name])
    whole = mass.blurred()
    return {name: one.blurred() < least[name] * whole for name, one in sums.items()}


def _beside(
    state: TextureState, rays: Rays, images: Pictures, passes: int, outlines: Silhouettes, light: Light
) -> NDArray[np.float64]:
    """Of each cell, how much of what it shows lies on the subject in pictures whose outline is known; 1 if nothing."""
    seen, camera, pixel = _look(state, rays, images.frame(outlines.frame), passes, outlines.frame, light)
    share = outlines.of(camera, pixel)
    known = np.isfinite(share)
    size = state.params.pruning.room_texels
    inside, mass = _Cells(state.shape, size), _Cells(state.shape, size)
    inside.add(seen[known], share[known])
    mass.add(seen[known], np.ones(int(known.sum())))
    whole = mass.blurred()
    return np.where(whole > 0, inside.blurred() / np.maximum(whole, 1e-12), 1.0)


def _look(
    state: TextureState, rays: Rays, picture: NDArray[np.uint8], passes: int, frame: int, light: Light
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
    """What rays of a frame see, lit, (R, 6) as `TextureState.look` gives it, and their cameras and pixels (R,); picture
    (C, pixels, 3) of the frame."""
    views, chosen = rays.part(frame, 0, passes)
    seen = np.zeros((len(views.pixel), 6), np.float32)
    state.look(views, picture, frame, seen)
    light(state, views, frame)
    if len(state.shine):
        seen[:, :3] -= seen[:, 3:4] * state.shine
    return seen[chosen], views.camera[chosen], views.pixel[chosen]


class _Cells:
    """Sums over squares of texels, of what rays see there, by their opacity."""

    def __init__(self, shape: tuple[int, int], size: int) -> None:
        self.shape, self.size = shape, size
        self.sums = np.zeros((-(-shape[0] // size), -(-shape[1] // size)))

    def add(self, seen: NDArray[np.float32], values: NDArray[np.floating]) -> None:
        """seen (R, 6) as above; values (R,)."""
        opacity = seen[:, 3]
        place = seen[:, 4:] / np.maximum(opacity, 1e-6)[:, None]
        (h, w), (rows, columns) = self.shape, self.sums.shape
        row = (place[:, 1] * h / self.size).astype(int).clip(0, rows - 1)
        column = (place[:, 0] * w / self.size).astype(int).clip(0, columns - 1)
        np.add.at(self.sums, (row, column), values * opacity)

    def blurred(self) -> NDArray[np.float64]:
        blurred: NDArray[np.float64] = ndimage.gaussian_filter(self.sums, 1.0, mode="nearest")
        return blurred


def _opacity(state: TextureState) -> NDArray[np.float32]:
    """(H, W) of all layers together, the most over all frames."""
    clear = [(1 - state.activated(k)[..., 3]).prod(1) for k in range(len(state.steps))]
    opacity: NDArray[np.float32] = 1 - torch.stack(clear).amin(0).view(*state.shape).numpy()
    return opacity


def specks(opacity: NDArray[np.floating], params: PruningParams) -> tuple[NDArray[np.bool_], int]:
    """Where nothing is near a large patch of opacity, and how many small patches lie there.

    Layers over one window of directions can show what floats apart from the head: rests of the room, or of the subject
    where a single camera saw it. From another side they are splinters in the air.

    Args:
        opacity: (H, W) of all layers together, the most over all frames.

    Returns:
        (H, W) bool; nowhere, and 0, where there is no opacity at all or `speck_share` is 0.
    """
    labels, count = ndimage.label(opacity > params.speck_opacity, np.ones((3, 3)))
    if count < 2 or params.speck_share == 0:
        return np.zeros(opacity.shape, bool), 0
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    large = sizes >= params.speck_share * sizes.max()
    reach = 2 * params.speck_reach + 1
    near = ndimage.maximum_filter(large[labels], reach)
    return ~near, int(count - large.sum())
