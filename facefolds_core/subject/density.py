"""Fewer Gaussians where there is nothing, more where the pictures pull."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from facefolds_core.subject.params import StartParams
from facefolds_core.subject.splats import MEAN, OPACITY, SCALE, TURN

if TYPE_CHECKING:
    from facefolds_core.subject.fit import State

APART, NARROW = 0.7, 0.7
"""Two halves of a Gaussian stand so far from its middle on its longest axis, and are so long, in standard deviations."""
FAINTER = 0.8
"""Opacity of the halves, in shares of the whole's."""


def thinned(state: State, params: StartParams) -> State:
    """Without those that are hardly there."""
    kept = state.values[:, OPACITY] > np.log(params.fewest / (1 - params.fewest))
    kept &= np.isfinite(state.values).all(1)
    return _part(state, kept)


def grown(state: State, wanted: int) -> State:
    """With so many Gaussians: those that the pictures pull at most are split along their longest axes."""
    more = min(wanted - len(state.values), len(state.values))
    pull = state.moved / np.maximum(state.met, 1)
    state.moved[:], state.met[:] = 0, 0
    if more <= 0:
        return state
    chosen = np.argpartition(-pull, more - 1)[:more]
    halves = state.values[chosen].copy()
    longest = np.argmax(halves[:, SCALE], 1)
    rows = np.arange(more)
    offset = APART * np.exp(halves[rows, 3 + longest])[:, None] * _axis(halves[:, TURN], longest)
    halves[rows, 3 + longest] += np.log(NARROW)
    opacity = FAINTER / (1 + np.exp(-halves[:, OPACITY]))
    halves[:, OPACITY] = np.log(opacity / (1 - opacity))
    others = halves.copy()
    halves[:, MEAN] += offset
    others[:, MEAN] -= offset
    state.values[chosen] = halves
    state.first[chosen] = 0
    zeros = np.zeros(more, np.float32)
    state.first = np.concatenate([state.first, np.zeros_like(others)])
    state.second = np.concatenate([state.second, state.second[chosen]])
    state.values = np.concatenate([state.values, others])
    state.moved, state.met = np.concatenate([state.moved, zeros]), np.concatenate([state.met, zeros])
    return state


def _axis(turn, which):  # type: ignore[no-untyped-def]
    """(n, 3) unit vector along axis `which` (n,) of quaternions (n, 4)."""
    w, x, y, z = (turn / np.linalg.norm(turn, axis=1, keepdims=True)).T
    columns = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(columns).transpose(2, 0, 1)[np.arange(len(which)), which]


def _part(state: State, kept) -> State:  # type: ignore[no-untyped-def]
    for name in ("values", "first", "second", "moved", "met"):
        setattr(state, name, np.ascontiguousarray(getattr(state, name)[kept]))
    return state
