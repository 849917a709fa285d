"""Texture grids whose steps run in plain torch (`reference.py`) on a device: what `device: cuda` trains with.

Sums are added in any order there, so that runs differ in their last bits. Crossings are found by the CPU's kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.training.explicit import reference
from facefolds_core.training.explicit.rates import BETAS
from facefolds_core.training.explicit.smoothing import smooth_reference
from facefolds_core.training.explicit.state import MIN_LIGHT, TextureState
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.views import Rays, Views

GRIDS = ("colour", "layers", "frame_colour", "frame_alpha")


class _Home:
    """An attribute of `TextureState`: whoever asks for it gets it in memory, as it is on the device, and may change
    it."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_home_{name}"

    def __get__(self, state: TorchTextureState, owner: type) -> Tensor:
        state.come_home()
        value: Tensor = getattr(state, self._name)
        return value

    def __set__(self, state: TorchTextureState, value: Tensor) -> None:
        state.come_home()
        setattr(state, self._name, value)


class TorchTextureState(TextureState):
    """A `TextureState` that lives on one side at a time: `step` takes it to the device; who reads or writes an
    attribute takes it home. Both are seldom needed between the steps of a level.

    Args:
        device: where steps run.
        arguments: of `TextureState`.
    """

    colour = _Home()
    layers = _Home()
    frame_colour = _Home()
    frame_alpha = _Home()
    _away: dict[str, Tensor] | None = None

    def __init__(self, device: torch.device, *arguments: Any) -> None:
        self._device = device
        super().__init__(*arguments)

    def come_home(self) -> None:
        """Take all values and moments from the device, if they are there."""
        away, self._away = self._away, None
        for name, values in (away or {}).items():
            getattr(self, f"_home_{name}").copy_(values)

    def _go(self) -> dict[str, Tensor]:
        """All values and moments on the device: taken there, unless they are there."""
        if self._away is None:
            self._away = {name: getattr(self, name).to(self._device, copy=True) for name in GRIDS}
        return self._away

    def _activated(self, frame: int) -> Tensor:
        """[M, N, 4] of one frame, on the device."""
        away = self._go()
        return reference.activate(
            away["colour"][0], away["layers"][0], away["frame_colour"][0, frame], away["frame_alpha"][0, frame]
        )

    def activated(self, frame: int) -> Tensor:
        if self._away is None:
            return super().activated(frame)
        return self.texture.copy_(self._activated(frame))

    def _step(
        self,
        views: Views,
        rays: NDArray[np.int64],
        pictures: CutOuts,
        frame: int,
        min_alpha: float,
        rates: NDArray[np.float32],
        correct: NDArray[np.float32],
    ) -> float:
        away, (h, w) = self._go(), self.shape
        texture = self._activated(frame)
        codes, of = _rays(views, rays)
        camera, pixel = views.camera[rays], views.pixel[rays]
        gradient, squares = reference.shade(
            self._there(codes),
            self._there(of),
            self._there(pictures.cut(frame)[camera, pixel]) / 255,
            self._there(pictures.behind[camera]),
            texture.view(h, w, -1, 4),
            self._there(self.shine[rays] if len(self.shine) else np.zeros((len(rays), 3), np.float32)),
            min_alpha,
            MIN_LIGHT,
        )
        reference.adam_step(
            away["colour"],
            away["layers"],
            away["frame_colour"][:, frame],
            away["frame_alpha"][:, frame],
            texture,
            gradient.view_as(texture),
            self._there(rates),
            float(self.kept_of_frames),
            self._there(correct),
            BETAS,
        )
        return float(squares)

    def _there(self, array: NDArray[Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(self._device)

    def _go_back(self, believed: Tensor, share: float) -> None:
        self._go()["layers"][0, ..., 3].lerp_(believed.to(self._device), share)

    def smooth_alpha(self, frame: int) -> None:
        self._smooth(self._go()["layers"][0, ..., 3])
        self.smooth_frame(frame)

    def smooth_frame(self, frame: int) -> None:
        self._smooth(self._go()["frame_alpha"][0, frame])

    def _smooth(self, logits: Tensor) -> None:
        logits.copy_(smooth_reference(logits, *self.shape))

    def contributions(self, source: Rays, passes: int) -> Tensor:
        (h, w), frames, n = self.shape, len(self.steps), self._go()["layers"].shape[2]
        peak = torch.zeros(n, h, w, device=self._device)
        for i in range(max(passes, frames)):
            views, rays = source.part(i % frames, i % passes, passes)
            codes, texture = views.codes[rays].astype(np.int32), self._activated(i % frames).view(h, w, n, 4)
            peak = torch.maximum(peak, reference.contributions(self._there(codes), texture, MIN_LIGHT))
        return peak.view(n, -1).T.contiguous().cpu()


def _rays(views: Views, rays: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Codes (S, N, 2) of all rays of some pixels, and which of these pixels each is of."""
    which = views.which[rays]
    single, spread = np.flatnonzero(which < 0), np.flatnonzero(which >= 0)
    finer = views.finer[which[spread]]
    codes = np.concatenate([views.codes[rays[single]], finer.reshape(-1, *views.codes.shape[1:])])
    return codes.astype(np.int32), np.concatenate([single, spread.repeat(finer.shape[1])])
