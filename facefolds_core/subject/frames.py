"""The subject's Gaussians in other frames: those change where the pictures do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.drawing import differentiate, draw
from facefolds_core.subject.fit import State, TargetPicture, improve, target_of
from facefolds_core.subject.gaussians import GaussianMethod
from facefolds_core.subject.splats import COLOUR, MEAN, Splats

Array = NDArray[np.float32]

STEPS = 64
"""Of a frame, on one picture each."""
METHOD = GaussianMethod(rate_colour=0.015)
"""Colours move faster than those of a start: in so few steps they must come from skin to the white of an eye."""
RIDE = 0.03
"""Gaussians so far off a tracked mesh, units, stay where they are: a mesh knows no hair. Nearer ones ride in part."""
CHANGED = 0.02
"""A Gaussian changes in a frame if its pixels err by this much more than in the frame of the start."""


def mean_errors(splats: Splats, targets: Sequence[TargetPicture]) -> Array:
    """(N,) mean of |C - I| + |opacity's error| over the pixels that show a Gaussian, weighted as they show it; 0 of
    those that none shows."""
    sums, weights = shown_errors(splats, targets)
    return np.where(weights > 0, sums / np.maximum(weights, 1e-6), 0).astype(np.float32)


def shown_errors(splats: Splats, targets: Sequence[TargetPicture]) -> tuple[Array, Array]:
    """(N,) sums of these errors, and of their weights; of targets with their room, of colours alone."""
    sums, weights = np.zeros(len(splats), np.float32), np.zeros(len(splats), np.float32)
    for target in targets:
        drawing = draw(splats.values, target.view)
        if target.opacity is None:
            behind = drawing.light * splats.background[:, None, None]
            error = np.abs(drawing.rgb + behind - target.picture).mean(0)
        else:
            error = np.abs(drawing.rgb - target.picture).mean(0) + np.abs(1 - drawing.light - target.opacity)
        inside, (width, height) = np.zeros_like(error), target.view.size
        inside[:height, :width] = 1  # tiles reach beyond the picture
        wish = np.stack([error * inside, inside, np.zeros_like(error)])
        gradient, _ = differentiate(splats.values, drawing, wish, np.zeros_like(error))
        sums += gradient[:, COLOUR][:, 0]
        weights += gradient[:, COLOUR][:, 1]
    return sums, weights


def targets_of(cameras: Sequence[Camera], cut: NDArray[np.uint8]) -> list[TargetPicture]:
    """Of cut-outs (C, H W, 4), RGBA with colours times opacity."""
    found = []
    for camera, flat in zip(cameras, cut, strict=True):
        picture = flat.reshape(camera.height, camera.width, 4).astype(np.float32) / np.float32(255)
        found.append(target_of(camera, picture[..., :3], picture[..., 3], 1.0))
    return found


def ridden(splats: Splats, start: NDArray[np.float64], now: NDArray[np.float64]) -> Splats:
    """The Gaussians in another frame, where they ride on a tracked mesh: each moves as the nearest vertex does.

    Args:
        start, now: (V, 3) vertices in the frame of the Gaussians and in the other, units.
    """
    distance, nearest = cKDTree(start).query(splats.means.astype(np.float64))
    share = np.clip(1 - distance / RIDE, 0, 1)[:, None]
    values = splats.values.copy()
    values[:, MEAN] += (share * (now - start)[nearest]).astype(np.float32)
    return Splats(values, splats.background)


def changed_to(splats: Splats, usual: Array, targets: Sequence[TargetPicture], seed: int) -> Splats:
    """The Gaussians as one frame's pictures show them; those that the pictures do not contradict stay as they are.

    Args:
        splats: of the frame of the start.
        usual: (N,) their `mean_errors` there.
        targets: cut-outs of this frame.
    """
    chosen = mean_errors(splats, targets) - usual > CHANGED
    if not chosen.any():
        return splats
    random, state = np.random.default_rng(seed), State.of(splats.values.copy())
    order = np.concatenate([random.permutation(len(targets)) for _ in range(-(-STEPS // len(targets)))])
    for step, which in enumerate(order[:STEPS]):
        behind = random.random(3, np.float32)
        improve(state, targets[which], behind, METHOD, step / STEPS, step, random, chosen)
    return Splats(state.values, splats.background)
