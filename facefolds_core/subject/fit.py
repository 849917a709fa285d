"""Fit Gaussians to pictures: small ones first; fewer where there is nothing, more where the pictures pull."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from facefolds_core.geometry.cameras import Camera
from facefolds_core.kernels.adam import corrections, decays
from facefolds_core.subject.adam_kernel import adam_step
from facefolds_core.subject.drawing import SplatCamera, differentiate, draw, view_of
from facefolds_core.subject.gaussians import GaussianMethod
from facefolds_core.subject.loss import picture_loss
from facefolds_core.subject.seeds import seeds
from facefolds_core.subject.splats import COLOUR, COLUMNS, MEAN, OPACITY, SCALE, SHINE, TURN, Splats, longest_axes

Array = NDArray[np.float32]

BETAS = (0.9, 0.999)
ABSENT = -20.0
"""Logit of the opacity of a Gaussian that is left out of a picture."""
APART, NARROW = 0.7, 0.7
"""Halves of a Gaussian stand so far from its middle on its longest axis, and are so long, in standard deviations."""
FAINTER = 0.8
"""Opacity of the halves, in shares of the whole's."""


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
class TargetPicture:
    """A training picture of one size, of whole tiles.

    Attributes:
        view: its camera.
        picture: (3, H, W) float32; of a cut-out colours times opacity.
        opacity: (H, W) float32 of the subject, or None where the room is in the picture, too.
        doubtful: (4, H, W) float32, where it is doubtful whether a cut-out's opacity is right: the picture, and 1, both
            times how doubtful it is.
    """

    view: SplatCamera
    picture: Array
    opacity: Array | None = None
    doubtful: Array | None = None

    def before(self, behind: Array) -> tuple[Array, Array]:
        """(3, H, W) each: a cut-out over a colour (3,), else the picture; and what is behind: that colour, but where
        opacity is doubtful the picture itself, before which the subject may be or not."""
        room = behind[:, None, None]
        if self.opacity is None:
            return self.picture, room
        if self.doubtful is not None:
            room = room * (1 - self.doubtful[3]) + self.doubtful[:3]
        return np.asarray(self.picture + (1 - self.opacity) * room, np.float32), room


def fit_pictures(
    cameras: Sequence[Camera],
    pictures: Sequence[Array],
    params: GaussianMethod,
    seed: int = 0,
    opacities: Sequence[Array] | None = None,
    begun: Splats | None = None,
    doubtful: Sequence[Array | None] | None = None,
) -> Splats:
    """Gaussians of some pictures (H, W, 3) float32 in [0, 1]: of the room as well, or of the subject alone.

    Args:
        opacities: (H, W) in [0, 1] of the subject; its colours times opacity are the pictures then, and it is
            compared over a colour that changes with each step.
        begun: Gaussians to begin with; they get the last steps only, and stay as many.
        doubtful: (H, W, 4) of a picture where its opacity may be wrong, or None; see `TargetPicture`.
    """
    random = np.random.default_rng(seed)
    pixels = sum(picture.shape[0] * picture.shape[1] for picture in pictures)
    count = int(np.clip(pixels / params.pixels, params.fewest, params.most))
    first, starting = 0, int(params.seeds * count)
    if begun is None:
        over = pictures if opacities is None else [_over_grey(*pair) for pair in zip(pictures, opacities, strict=True)]
        state = State.of(seeds(cameras, over, starting, params.ball, random, opacities))
    else:
        first, state = int((1 - params.again) * params.iterations), State.of(begun.values.copy())
    background = np.mean([picture.mean((0, 1)) for picture in pictures], 0).astype(np.float32)
    targets: list[TargetPicture] = []
    level, order = -1.0, np.arange(0)
    for step in range(first, params.iterations):
        done = step / params.iterations
        size = [share for start, share in params.levels if start <= done][-1]
        if size != level:
            nothing, level = [None] * len(cameras), size
            each = zip(cameras, pictures, opacities or nothing, doubtful or nothing, strict=True)
            targets = [target_of(*one[:3], size, one[3]) for one in each]
        if not len(order):
            order = random.permutation(len(targets))
        behind = background if opacities is None else random.random(3, np.float32)
        improve(state, targets[order[0]], behind, params, done, step - first, random)
        order = order[1:]
        if (step + 1) % params.every == 0 and done < params.grown:
            wanted = starting + (count - starting) * (step + 1) / (params.grown * params.iterations)
            state = grown(thinned(state, params), min(int(wanted), count))
    return Splats(thinned(state, params).values, background if opacities is None else np.zeros(3, np.float32))


def _over_grey(picture: Array, opacity: Array) -> Array:
    return np.asarray(picture + (1 - opacity[..., None]) * np.float32(0.5))


def improve(
    state: State,
    target: TargetPicture,
    behind: Array,
    params: GaussianMethod,
    done: float,
    before: int,
    random: np.random.Generator,
    chosen: NDArray[np.bool_] | None = None,
) -> None:
    """One step of Adam, after so many `before`, towards one picture over a colour (3,); some Gaussians are left out, so
    that none hides what another gets wrong (DropGaussian, Park et al. 2025).

    Args:
        done: share of the steps that are done.
        chosen: (N,) which Gaussians move; None for all.
    """
    values = state.values.copy()
    values[random.random(len(values)) < params.dropped, OPACITY] = ABSENT
    drawing = draw(values, target.view)
    wish, wish_light = picture_loss(drawing, *target.before(behind), params.structure)
    gradient, moved = differentiate(values, drawing, wish, wish_light)
    seen = np.diff(drawing.first) > 0
    if chosen is not None:
        seen &= chosen
    state.moved += moved * max(target.view.size) / 2
    rates, correct = _rates(params, done), np.array(corrections(BETAS, before + 1), np.float32)
    adam_step(state.values, state.first, state.second, gradient, seen, rates, correct, decays(BETAS))


def thinned(state: State, params: GaussianMethod) -> State:
    """Without those that are hardly there."""
    kept = state.values[:, OPACITY] > np.log(params.faintest / (1 - params.faintest))
    kept &= np.isfinite(state.values).all(1)
    return State(state.values[kept], state.first[kept], state.second[kept], state.moved[kept])


def grown(state: State, wanted: int) -> State:
    """With so many Gaussians: those that the pictures pull at most are split along their longest axes."""
    more = min(wanted - len(state.values), len(state.values))
    pull = state.moved.copy()  # of all pictures: what many cameras see is divided first
    state.moved[:] = 0
    if more <= 0:
        return state
    chosen = np.argpartition(-pull, more - 1)[:more]
    halves = state.values[chosen].copy()
    offset = APART * longest_axes(halves)
    rows, longest = np.arange(more), np.argmax(halves[:, SCALE], 1)
    halves[rows, 3 + longest] += np.log(NARROW)
    opacity = FAINTER / (1 + np.exp(-halves[:, OPACITY]))
    halves[:, OPACITY] = np.log(opacity / (1 - opacity))
    others = halves.copy()
    halves[:, MEAN] += offset
    others[:, MEAN] -= offset
    state.values[chosen] = halves
    state.first[chosen] = 0
    state.first = np.concatenate([state.first, np.zeros_like(others)])
    state.second = np.concatenate([state.second, state.second[chosen]])
    state.values = np.concatenate([state.values, others])
    state.moved = np.concatenate([state.moved, np.zeros(more, np.float32)])
    return state


def target_of(
    camera: Camera, picture: Array, opacity: Array | None, size: float, doubtful: Array | None = None
) -> TargetPicture:
    """A picture (H, W, 3) with its opacity (H, W), `size` times as large; doubtful (H, W, 4), see `TargetPicture`."""
    width, height = max(8, round(camera.width * size)), max(8, round(camera.height * size))
    view = view_of(camera.resized(width, height))

    def padded(image: Array) -> Array:
        whole = np.zeros((image.shape[2], *view.padded), np.float32)
        whole[:, :height, :width] = np.moveaxis(_smaller(image, width, height), -1, 0)
        return whole

    if opacity is None:
        return TargetPicture(view, padded(picture))
    whole = padded(np.dstack([picture, opacity]))
    return TargetPicture(view, whole[:3], whole[3], None if doubtful is None else padded(doubtful))


def _smaller(image: Array, width: int, height: int) -> Array:
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.float32)


def _rates(params: GaussianMethod, done: float) -> Array:
    """(COLUMNS,) of Adam."""
    rates = np.empty(COLUMNS, np.float32)
    first, last = params.rate_mean
    rates[MEAN] = first * (last / first) ** done
    rates[SCALE], rates[TURN], rates[OPACITY] = params.rate_scale, params.rate_turn, params.rate_opacity
    rates[COLOUR], rates[SHINE] = params.rate_colour, params.rate_shine
    return rates
