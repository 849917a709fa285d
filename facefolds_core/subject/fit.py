"""Fit Gaussians to the training pictures of one frame, the room included: small pictures first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.adam_kernel import adam_step
from facefolds_core.subject.density import grown, thinned
from facefolds_core.subject.drawing import View, differentiate, draw, view_of
from facefolds_core.subject.loss import picture_loss
from facefolds_core.subject.params import StartParams
from facefolds_core.subject.seeds import seeds
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, SHINE, TURN, Splats
from facefolds_core.training.adam import corrections, decays

Array = NDArray[np.float32]

BETAS = (0.9, 0.999)
ABSENT = -20.0
"""Logit of the opacity of a Gaussian that is left out of a picture."""


@dataclass
class State:
    """Gaussians while they are fitted.

    Attributes:
        values, first, second: (N, COLUMNS), and Adam's moments.
        moved: (N,) sum of `unproject`'s `moved` since Gaussians were split last.
    """

    values: Array
    first: Array
    second: Array
    moved: Array

    @classmethod
    def of(cls, values: Array) -> State:
        zeros = np.zeros(len(values), np.float32)
        return cls(values, np.zeros_like(values), np.zeros_like(values), zeros)


@dataclass(frozen=True)
class Target:
    """A training picture of one size.

    Attributes:
        view: its camera.
        picture: (3, H, W) float32 of whole tiles.
    """

    view: View
    picture: Array


def fit_start(scene: Scene, frame: int = 0, params: StartParams | None = None, seed: int = 0) -> Splats:
    """Gaussians of the training pictures of one frame."""
    return fit_pictures(*pictures_of(scene, frame, scene.indices("train")), params or StartParams(), seed)


def pictures_of(scene: Scene, frame: int, cameras: Sequence[int]) -> tuple[list[Camera], list[Array]]:
    """Those of some cameras that have a picture of the frame, and the pictures, (H, W, 3) float32 in [0, 1]."""
    store = scene.open_frames()
    there = [i for i in cameras if (i, frame) in store]
    pictures = [store.image(i, frame).astype(np.float32) / np.float32(255) for i in there]
    return [scene.camera_in_head(i, frame) for i in there], pictures


def fit_pictures(cameras: Sequence[Camera], pictures: Sequence[Array], params: StartParams, seed: int = 0) -> Splats:
    """Gaussians of some pictures (H, W, 3) float32 in [0, 1]."""
    random = np.random.default_rng(seed)
    pixels = sum(picture.shape[0] * picture.shape[1] for picture in pictures)
    count = int(np.clip(pixels / params.pixels, params.fewest, params.most))
    begun = int(params.seeds * count)
    state = State.of(seeds(cameras, pictures, begun, params.ball, random))
    background = np.mean([picture.mean((0, 1)) for picture in pictures], 0).astype(np.float32)
    targets: list[Target] = []
    level, order = -1.0, np.arange(0)
    for step in range(params.iterations):
        done = step / params.iterations
        size = [share for start, share in params.levels if start <= done][-1]
        if size != level:
            level, targets = size, [_target(*pair, size) for pair in zip(cameras, pictures, strict=True)]
        if not len(order):
            order = random.permutation(len(targets))
        _improve(state, targets[order[0]], background, params, step, random)
        order = order[1:]
        if (step + 1) % params.every == 0 and done < params.grown:
            wanted = begun + (count - begun) * (step + 1) / (params.grown * params.iterations)
            state = grown(thinned(state, params), min(int(wanted), count))
    return Splats(thinned(state, params).values, background)


def _improve(
    state: State, target: Target, background: Array, params: StartParams, step: int, random: np.random.Generator
) -> None:
    """One step of Adam towards one picture; some Gaussians are left out, so that none hides what another gets wrong
    (DropGaussian, Park et al. 2025)."""
    values = state.values.copy()
    values[random.random(len(values)) < params.dropped, OPACITY] = ABSENT
    drawing = draw(values, target.view)
    wish, wish_light = picture_loss(drawing, target.picture, background, params.structure)
    gradient, moved = differentiate(values, drawing, wish, wish_light)
    seen = np.diff(drawing.first) > 0
    state.moved += moved * max(target.view.size) / 2
    rates, correct = _rates(params, step / params.iterations), np.array(corrections(BETAS, step + 1), np.float32)
    adam_step(state.values, state.first, state.second, gradient, seen, rates, correct, decays(BETAS))


def _target(camera: Camera, picture: Array, size: float) -> Target:
    width, height = max(8, round(camera.width * size)), max(8, round(camera.height * size))
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    view = view_of(camera.resized(width, height))
    whole = np.zeros((3, *view.padded), np.float32)
    whole[:, :height, :width] = np.moveaxis(small, -1, 0)
    return Target(view, whole)


def _rates(params: StartParams, done: float) -> Array:
    """(COLUMNS,) of Adam."""
    rates = np.empty(COLUMNS, np.float32)
    first, last = params.rate_mean
    rates[MEAN] = first * (last / first) ** done
    rates[SCALE], rates[TURN], rates[OPACITY] = params.rate_scale, params.rate_turn, params.rate_opacity
    rates[COLOUR], rates[SHINE] = params.rate_colour, params.rate_shine
    return rates
