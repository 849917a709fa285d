"""One frame of a take, fitted alone against the base: what all frames share stays as it is.

A frame's result depends on the base and on the frame alone: not on its neighbours, on the segment that it is in, or on
who fits it. So there are no seams between segments.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from facefolds_core.captures.part import part_of
from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.follow import follow_frame, follow_rates, lagging, mean_errors
from facefolds_core.training.explicit.rates import falling, rates_of
from facefolds_core.training.explicit.state import MIN_ALPHA, TextureState
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.views import MovingRays, RaySource, StillRays, Views, trace_views
from facefolds_core.training.segments.base import Base


class FrameFitter:
    """Fits frames, one at a time: memory of one frame.

    Args:
        scene: with the cameras that the base was made with.
        base: see there.
        params: of the training.
        views: crossings of the rays of a still head, if they are known,
        shine: and what the reflection adds to each (`shine_of`).
    """

    def __init__(
        self,
        scene: Scene,
        base: Base,
        params: ExplicitParams,
        views: Views | None = None,
        shine: NDArray[np.float32] | None = None,
    ) -> None:
        self.scene, self.base, self.params = scene, base, params
        self.pictures = CutOuts(scene, base.surroundings.gains, kept_bytes=0)
        h, w = base.spec.texels
        shape = (base.spec.num_layers, 1)
        self.state = TextureState((h, w), *shape, torch.zeros(2, 2, 3), self.params)
        with torch.no_grad():
            self.state.colour[0].copy_(base.textures.colour.view(h * w, 3))
            self.state.layers[0].copy_(base.textures.layers.view(h * w, -1, 4))
        self.still, self.maps = None, base.lit(params.reflection)
        if scene.poses is None:
            views = views or trace_views(scene, base.manifolds, 1)
            self.still = StillRays(views)
            self.state.shine = shine_of(base, params, views) if shine is None else shine

    def fit(self, frame: int, shares: NDArray[np.float64], seed: bytes) -> tuple[tuple[Tensor, Tensor, float], int]:
        """Fit one.

        Args:
            frame: of the scene.
            shares: of the key frames that it starts from.
            seed: of the draw of rays; of this frame, so that it is the same in every take.

        Returns:
            its colour [H, W, 3] and alpha [H, W, N], float16, and PSNR of the rays of the last steps, dB; and the rays
            that were shaded in all steps.

        Raises:
            UserError: if it diverges.
        """
        state, params = self.state, self.params
        self._start(shares)
        random = np.random.default_rng(list(seed))
        views = self._rays(frame, random)
        texels = state.shape[0] * state.shape[1]
        parts = max(1, int(views.count / (params.textures.rays_per_texel * texels)))
        steps = params.segments.steps
        phases: list[int] = []
        rays, errors = 0, []
        pictures, self.pictures.only = self.pictures, frame
        for i in range(steps):
            phases = phases or random.permutation(parts).tolist()
            seen, which = views.part(0, phases.pop(), parts)
            self._light(frame, seen)
            errors.append(state.step(seen, which, pictures, 0, MIN_ALPHA, self._rates(i / steps)))
            if i % params.textures.smooth_every == 0:
                state.smooth_frame(0)
            rays += len(which)
        if not np.isfinite(errors).all():
            raise _diverged(self.scene, frame)
        self._follow(frame, views, pictures)
        psnr = -10 * float(np.log10(max(float(np.mean(errors[-parts:])), 1e-12)))
        h, w = state.shape
        colour, alpha = state.frame_colour[0, 0].view(h, w, 3), state.frame_alpha[0, 0].view(h, w, -1)
        return (colour.half(), alpha.half(), psnr), rays

    def _light(self, frame: int, seen: Views) -> None:
        """What the reflection adds to rays of a frame, if they are others in each frame."""
        if self.maps is not None and self.scene.poses is not None:
            self.state.shine = self.maps.on_rays(seen, self.scene.poses.at(frame).rotation)

    def _follow(self, frame: int, views: RaySource, pictures: CutOuts) -> None:
        """Where the frame does not follow yet what moves."""
        state, found = self.state, self.base.surroundings

        def light(_: TextureState, seen: Views, __: int) -> None:
            self._light(frame, seen)

        errors = mean_errors(state, views, pictures, 0, light)
        chosen = lagging(errors - found.usual, state.shape, self.params.follow.min_error)
        follow_frame(state, views, pictures, 0, chosen, errors, follow_rates(self.params), light)

    def _start(self, shares: NDArray[np.float64]) -> None:
        colour, alpha = self.base.mixed(shares)
        state = self.state
        state.frame_colour.zero_()
        state.frame_alpha.zero_()
        state.frame_colour[0, 0].copy_(colour.view(-1, 3))
        state.frame_alpha[0, 0].copy_(alpha.view(len(state.frame_alpha[0, 0]), -1))
        state.steps[:] = 0

    def _rays(self, frame: int, random: np.random.Generator) -> RaySource:
        if self.still is not None:
            return self.still
        h, w = self.state.shape
        share = self.params.textures.rays_per_texel * h * w
        alone = part_of(self.scene, [frame])
        first = int(random.integers(1 << 30))
        return MovingRays(alone, self.base.manifolds, 1, share, first)

    def _rates(self, progress: float) -> NDArray[np.float32]:
        rates = rates_of(self.params.textures.learning_rate * falling(progress))
        rates[:3] = 0  # what all frames share stays as it is
        return rates


def shine_of(base: Base, params: ExplicitParams, views: Views) -> NDArray[np.float32]:
    """(P, 3) what the reflection adds to the rays of a still head; (0, 3) where frames are fitted without."""
    maps = base.lit(params.reflection)
    return np.zeros((0, 3), np.float32) if maps is None else maps.on_rays(views)


def _diverged(scene: Scene, frame: int) -> UserError:
    return UserError(
        "training diverged",
        place=f"frame {scene.frame_ids[frame]}",
        expected="a finite error",
        remedy="look at the frame's pictures",
    )
