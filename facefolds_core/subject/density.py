"""Fewer Gaussians where there is nothing, more where the pictures pull."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from facefolds_core.subject.gaussians import GaussianParams
from facefolds_core.subject.splats import MEAN, OPACITY, SCALE, TURN

if TYPE_CHECKING:
    from facefolds_core.subject.fit import State

Array = NDArray[np.float32]

APART, NARROW = 0.7, 0.7
"""Halves of a Gaussian stand so far from its middle on its longest axis, and are so long, in standard deviations."""
FAINTER = 0.8
"""Opacity of the halves, in shares of the whole's."""


def thinned(state: State, params: GaussianParams) -> State:
    """Without those that are hardly there."""
    kept = state.values[:, OPACITY] > np.log(params.faintest / (1 - params.faintest))
    kept &= np.isfinite(state.values).all(1)
    return _part(state, kept)


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


def longest_axes(values: Array) -> Array:
    """(n, 3) along the longest axes of Gaussians (n, COLUMNS), one standard deviation long."""
    w, x, y, z = (values[:, TURN] / np.linalg.norm(values[:, TURN], axis=1, keepdims=True)).T
    columns = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    rows, longest = np.arange(len(values)), np.argmax(values[:, SCALE], 1)
    axes = np.array(columns).transpose(2, 0, 1)[rows, longest]
    return np.asarray(axes * np.exp(values[rows, 3 + longest])[:, None], np.float32)


def _part(state: State, kept: NDArray[np.bool_]) -> State:
    for name in ("values", "first", "second", "moved"):
        setattr(state, name, np.ascontiguousarray(getattr(state, name)[kept]))
    return state
