"""Texture grids whose steps run on an NVIDIA GPU: the same kernels, and what is taken to and fro between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.kernels import gpu
from facefolds_core.kernels.adam import decays
from facefolds_core.training.explicit import kernels_gpu
from facefolds_core.training.explicit.rates import BETAS
from facefolds_core.training.explicit.state import MIN_LIGHT, TextureState
from facefolds_core.training.explicit.targets import Pictures
from facefolds_core.training.explicit.views import Rays, Views

SUMS = 256
"""Over which a step's squared errors are spread, so that threads seldom wait for one another."""


class _Home:
    """An attribute of `TextureState`: whoever asks for it gets it as it is on the GPU, and may change it."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_home_{name}"

    def __get__(self, state: GpuTextureState, owner: type) -> Tensor:
        state.come_home()
        value: Tensor = getattr(state, self._name)
        return value

    def __set__(self, state: GpuTextureState, value: Tensor) -> None:
        state.come_home()
        setattr(state, self._name, value)


@dataclass(frozen=True)
class _Away:
    """Of `TextureState`, on the GPU: colour, layers, and of each frame colour and alpha, each with its moments;
    activated texture (M, N, 4); gradient (N, M, 4)."""

    colour: Any
    layers: Any
    frames: list[tuple[Any, Any]]
    texture: Any
    gradient: Any
    squares: Any


class GpuTextureState(TextureState):
    """A `TextureState` that lives on one side at a time: `step` takes it to the GPU; who reads or writes an attribute
    takes it home. Both are seldom needed between the steps of a level."""

    colour = _Home()
    layers = _Home()
    frame_colour = _Home()
    frame_alpha = _Home()
    _away: _Away | None = None

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._kept = Kept(self.params.gpu.cache_megabytes << 20)

    def come_home(self) -> None:
        """Take all values and moments from the GPU, if they are there."""
        away, self._away = self._away, None
        if away is None:
            return
        away.colour.copy_to_host(self.colour.numpy())
        away.layers.copy_to_host(self.layers.numpy())
        for k, (colour, alpha) in enumerate(away.frames):
            self.frame_colour[:, k] = torch.from_numpy(colour.copy_to_host())
            self.frame_alpha[:, k] = torch.from_numpy(alpha.copy_to_host())

    def _go(self) -> _Away:
        """Take all values and moments to the GPU, unless they are there."""
        if self._away is None:
            m, n = self.layers.shape[1:3]
            frames = zip(self.frame_colour.unbind(1), self.frame_alpha.unbind(1), strict=True)
            self._away = _Away(
                gpu.to_gpu(self.colour.numpy()),
                gpu.to_gpu(self.layers.numpy()),
                [(gpu.to_gpu(colour.numpy()), gpu.to_gpu(alpha.numpy())) for colour, alpha in frames],
                gpu.empty((m, n, 4)),
                gpu.zeros((n, m, 4)),
                gpu.zeros(SUMS, np.float64),
            )
        return self._away

    def _activate(self, away: _Away, frame: int) -> None:
        colour, alpha = away.frames[frame]
        count = away.texture.shape[0]
        kernels_gpu.activate.run(count, away.colour[0], away.layers[0], colour[0], alpha[0], away.texture)

    def activated(self, frame: int) -> Tensor:
        if self._away is None:
            return super().activated(frame)
        self._activate(self._away, frame)
        self._away.texture.copy_to_host(self.texture.numpy())
        return self.texture

    def _step(
        self,
        views: Views,
        rays: NDArray[np.int64],
        pictures: Pictures,
        frame: int,
        min_alpha: float,
        rates: NDArray[np.float32],
        correct: NDArray[np.float32],
    ) -> float:
        away, (h, w) = self._go(), self.shape
        m, n = away.texture.shape[:2]
        self._activate(away, frame)
        away.squares.copy_to_device(np.zeros(SUMS))
        kernels_gpu.shade.run(
            len(rays),
            *self._views(views),
            gpu.to_gpu(rays),
            self._kept.get(("frame", frame), pictures, lambda: (gpu.to_gpu(pictures.cut(frame)),))[0],
            gpu.to_gpu(pictures.behind),
            away.texture.reshape(h, w, n, 4),
            self._kept.get("shine", self.shine, lambda: (gpu.to_gpu(self.shine),))[0],
            away.gradient.reshape(n, h, w, 4),
            (np.float32(min_alpha), MIN_LIGHT, False),
            away.squares,
            LAYERS=n,
            SAMPLES=views.finer.shape[1],
        )
        kernels_gpu.adam_step.run(
            m,
            away.colour,
            away.layers,
            *away.frames[frame],
            away.texture,
            away.gradient,
            gpu.to_gpu(rates),
            self.kept_of_frames,
            gpu.to_gpu(correct),
            gpu.to_gpu(decays(BETAS)),
        )
        return float(away.squares.copy_to_host().sum())

    def _go_back(self, believed: Tensor, share: float) -> None:
        goal = self._kept.get("believed", believed, lambda: (gpu.to_gpu(believed.numpy()),))[0]
        kernels_gpu.go_towards.run(len(believed), self._go().layers[0, :, :, 3], goal, np.float32(share))

    def _views(self, views: Views) -> tuple[Any, ...]:
        """See `Views.arrays`."""
        return self._kept.get(("views", id(views)), views, lambda: tuple(gpu.to_gpu(array) for array in views.arrays))

    def smooth_alpha(self, frame: int) -> None:
        self._smooth_there(self._go().layers[0, :, :, 3])
        self.smooth_frame(frame)

    def smooth_frame(self, frame: int) -> None:
        self._smooth_there(self._go().frames[frame][1][0])

    def _smooth_there(self, logits: Any) -> None:
        m, n = logits.shape
        smoothed = gpu.empty((m, n))
        kernels_gpu.smooth.run(m, logits, *self.shape, smoothed, LAYERS=n)
        kernels_gpu.go_towards.run(m, logits, smoothed, np.float32(1))

    def contributions(self, source: Rays, passes: int) -> Tensor:
        away, (h, w), frames = self._go(), self.shape, len(self.steps)
        n = away.texture.shape[1]
        peak = gpu.zeros((n, h, w))
        for i in range(max(passes, frames)):
            views, rays = source.part(i % frames, i % passes, passes)
            self._activate(away, i % frames)
            codes, texture = self._views(views)[0], away.texture.reshape(h, w, n, 4)
            kernels_gpu.contributions.run(len(rays), codes, gpu.to_gpu(rays), texture, peak, MIN_LIGHT, LAYERS=n)
        return torch.from_numpy(peak.copy_to_host()).view(n, -1).T.contiguous()


class Kept:
    """Copies on the GPU of what is used again, at most so many bytes; the one unused for longest goes first."""

    def __init__(self, room: int) -> None:
        self._room = room
        self._held: dict[Any, tuple[Any, tuple[Any, ...]]] = {}

    def get(self, key: Any, source: Any, make: Callable[[], tuple[Any, ...]]) -> tuple[Any, ...]:
        """What is kept under a key, if it was made of this very source."""
        found = self._held.pop(key, None)
        arrays = make() if found is None or found[0] is not source else found[1]
        self._held[key] = source, arrays
        while len(self._held) > 1 and self._bytes() > self._room:
            del self._held[next(iter(self._held))]
        return arrays

    def _bytes(self) -> int:
        return sum(int(array.nbytes) for _, arrays in self._held.values() for array in arrays)
