"""Scores of pictures of an earlier run: what is the same to the bit is not measured again.

Most of the time of an evaluation goes into the perceptual metrics. Pictures are rendered all the same: what they are
made of need not be known, and films and sums over time are made of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from facefolds_core.archives import read_npz
from facefolds_core.errors import UserError
from facefolds_core.export.kept import digest_of, digest_of_frame
from facefolds_core.files import atomic_file
from facefolds_core.scoring.images import Rendering, Values
from facefolds_core.scoring.panels import ALL_METRICS, VARIANTS
from facefolds_core.scoring.perceptual import Perceptual, PerceptualDistance
from facefolds_core.scoring.truths import MatteKind, Truth
from facefolds_core.source_code import digest_of_packages


def digest_of_metrics(perceptual: Perceptual, kind: MatteKind, background: ArrayLike, band: float) -> bytes:
    """Of all that is measured with, its code and the networks' weights included."""
    weights = [_weights(metric) for metric in (perceptual.lpips, perceptual.st_lpips)]
    settings = {"kind": kind, "background": np.asarray(background, np.float64), "band": band, "weights": weights}
    return digest_of({**settings, "torch": torch.__version__, "code": digest_of_packages("scoring")})


def _weights(metric: PerceptualDistance | None) -> str:
    if metric is None:
        return ""
    state = {name: value.cpu().numpy() for name, value in metric.state_dict().items()}
    return f"{metric.shift.device} {digest_of(state).hex()}"


class KeptScores:
    """Scores by what they are of.

    Args:
        path: npz of an earlier run, of `keys` (M, 16) uint8 and `values` (M, variants, metrics) float64, NaN where
            there is none; None keeps nothing.
        common: of `digest_of_metrics`.
    """

    def __init__(self, path: Path | None, common: bytes = b"") -> None:
        self._path, self._common = path, common
        self._known: dict[bytes, NDArray[np.float64]] = {}
        self._met: dict[bytes, NDArray[np.float64]] = {}
        if path is not None and path.exists():
            try:
                found = read_npz(path, "damaged scores")
                pairs = zip(found["keys"], found["values"].reshape(-1, len(VARIANTS), len(ALL_METRICS)), strict=True)
                self._known = {key.tobytes(): values for key, values in pairs}
            except (UserError, KeyError, ValueError):  # what is damaged is measured again
                self._known = {}

    def of(
        self, renderings: Mapping[str, Rendering], truth: Truth, make: Callable[[], dict[str, Values]]
    ) -> dict[str, Values]:
        """Of renderings (of all VARIANTS) beside a photo: those of the earlier run, or what `make` measures."""
        if self._path is None:
            return make()
        known = [truth.picture, truth.mask, truth.matte, truth.plate]
        shown = [part for name in VARIANTS for part in (renderings[name].rgb, renderings[name].alpha)]
        which = "".join("-" if one is None else "+" for one in known).encode()
        arrays = [one for one in [*known, *shown] if one is not None]
        key = bytes.fromhex(digest_of_frame(self._common + which, arrays))
        values = self._known.get(key)
        if values is None:
            values = np.array([[_number(made.get(name)) for name in ALL_METRICS] for made in _in_order(make())])
        self._met[key] = values
        rows = [[None if np.isnan(one) else one for one in row] for row in values.tolist()]
        return {name: dict(zip(ALL_METRICS, row, strict=True)) for name, row in zip(VARIANTS, rows, strict=True)}

    def keep(self) -> None:
        """Keep what was met, instead of what was there."""
        if self._path is None or not self._met:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        keys = np.frombuffer(b"".join(self._met), np.uint8).reshape(len(self._met), -1)
        with atomic_file(self._path) as temporary, temporary.open("wb") as file:
            np.savez(file, keys=keys, values=np.stack(list(self._met.values())))


def _in_order(values: Mapping[str, Values]) -> list[Values]:
    return [values[name] for name in VARIANTS]


def _number(value: float | None) -> float:
    return np.nan if value is None else value
