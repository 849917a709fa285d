"""The levels of a training of the explicit model, one after the other, and the model that comes out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from dvclive.live import Live
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.errors import UserError
from facefolds_core.facts import fact
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import ExplicitSpec
from facefolds_core.params import ExplicitParams
from facefolds_core.subject.outline import texel_middles
from facefolds_core.subject.volume import Volume
from facefolds_core.training.explicit.cameras import CameraChoice
from facefolds_core.training.explicit.fit import Fit, recentre, volume_in
from facefolds_core.training.explicit.follow import follow, follow_rates
from facefolds_core.training.explicit.gloss import GlossFit
from facefolds_core.training.explicit.plan import SETTLING, TrainingLevel, epochs
from facefolds_core.training.explicit.rates import falling, rates_of
from facefolds_core.training.explicit.second_surface import LAYERS, second_layers, shells_of_both
from facefolds_core.training.explicit.state import MIN_ALPHA, TextureState, on_one_thread
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.teacher import Teacher
from facefolds_core.training.explicit.views import MovingRays, RaySource, StillRays, trace_views
from facefolds_core.training.log import log_metrics

ERROR_RATIO, SMOOTHING = 9.0, 0.1
"""Training diverges where the running mean of the squared error is so many times the best of its level; share of the
newest step in that mean."""

GRAZING = 2.0
"""Layers begin as opaque as so many of what the Gaussians put there. Rays along an outline meet a sheet once, where
they go far through what the sheet stands for: with 1 outlines are too transparent, with 4 loose hair is lost."""

LAYER_ALPHA = 1 / 255
"""Outer or inner layers whose alpha is nowhere larger are dropped: no pixel changes by more."""


class Trainer:
    """A training under way: geometry in rounds at coarse textures, then textures coarse to fine on stored crossings.

    Attributes:
        layers: of both surfaces.
        usual: (M, 3) mean errors of the texels that no frame is blamed for, once it has ended.
    """

    def __init__(
        self,
        cameras: CameraChoice,
        params: ExplicitParams,
        fit: Fit,
        pictures: CutOuts,
        teacher: Teacher,
    ) -> None:
        self.cameras, self.params, self.fit = cameras, params, fit
        self.scene = cameras.scene
        self.pictures, self.teacher = pictures, teacher
        self.random = np.random.default_rng(params.seed)
        self.layers = params.layers + (LAYERS if fit.second.any() else 0)
        self.shift = np.zeros_like(fit.halfwidth)
        self.geometry = 0.0
        self.views: RaySource | None = None
        self.stride = 0
        self.state: TextureState | None = None
        self.iteration = self.rays = 0
        self.psnr = 0.0
        self.events = list(cameras.notes)
        real = len(self.scene.indices("train"))
        self.gloss = GlossFit(fit.chart, fit.window, params.reflection, cameras.scene.poses, photographed=real)
        self.usual = np.zeros((0, 3), np.float32)

    def distances(self) -> NDArray[np.float64]:
        """(rows, columns, N) of the first surface's layers from the surface of the fit, falling, units."""
        halfwidth = self.geometry * self.fit.halfwidth + self.fit.reach
        return self.shift[..., None] + halfwidth[..., None] * np.linspace(1, -1, self.params.layers)

    def manifolds(self) -> RadialManifolds:
        radii = self.fit.offsets.layers(self.distances())
        if self.layers > self.params.layers:
            radii = np.concatenate([radii, second_layers(self.fit.second, radii[..., -1])], -1)
        return self._manifolds(torch.from_numpy(radii).float())

    def _manifolds(self, radii: torch.Tensor) -> RadialManifolds:
        return RadialManifolds(self.fit.chart, self.fit.window, radii, self.fit.torso)

    def middle(self) -> NDArray[np.float64]:
        """(rows, columns) radii of the surface that the layers lie about, units."""
        return self.fit.offsets.radius(self.shift)

    def run(self, level: TrainingLevel, number: int, live: Live, bar: tqdm) -> None:
        """One level.

        Raises:
            UserError: if it diverges.
        """
        self._prepare(level)
        self._step(level, number, live, bar)
        self._judge_reflection(number, bar)
        if number >= len(self.params.geometry.rounds):
            self._follow()

    def _judge_reflection(self, number: int, bar: tqdm) -> None:
        """After a level, where it is time: whether the reflection helps."""
        assert self.state is not None and self.views is not None
        rounds = len(self.params.geometry.rounds)
        found = self.gloss.after(number, rounds, self.state, self.views, self.pictures)
        if found is not None:
            self.events.append(found)
            bar.write(f"train: {found}")

    def _prepare(self, level: TrainingLevel) -> None:
        """Geometry, stored crossings and grids of this level."""
        moved = self.geometry != level.geometry
        if moved and self.state is not None:
            self._recentre()
        new_rays = moved or self.stride != level.stride
        if new_rays:
            self._trace(level)
        assert self.views is not None
        begun = self.state is None
        if self.state is None:
            start = torch.from_numpy(self.fit.rgb).float()
            self.state = TextureState(level.texels, self.layers, self.scene.num_frames, start, self.params)
        elif self.state.shape != level.texels:
            self.state.grow(level.texels)
        self._begin_with_subject(begun or moved, colours=begun)
        if new_rays:
            self.gloss.follow(self.state, self.views, self.pictures, torch.from_numpy(self.middle()).float())

    def _trace(self, level: TrainingLevel) -> None:
        finest = level.texels if level.stride > 1 else self.fit.texels
        share = self.params.textures.rays_per_texel * finest[0] * finest[1]
        self.geometry, self.stride = level.geometry, level.stride
        args, virtual = (self.scene, self.manifolds(), level.stride), self.teacher.virtual
        if self.scene.poses is None:
            self.views = StillRays(trace_views(*args, virtual))
        else:
            self.views = MovingRays(*args, share, virtual=virtual)

    def _begin_with_subject(self, fill: bool, colours: bool) -> None:
        """Let the layers believe in the opacity of the subject's Gaussians, and begin with it, each frame with its own;
        with their colours."""
        assert self.state is not None
        shape = self.state.shape
        with on_one_thread():
            nodes = self.manifolds().radii().permute(2, 0, 1)[None]
            radii = torch.nn.functional.interpolate(nodes, size=shape, mode="bilinear", align_corners=False)
        places, uv = radii[0].permute(1, 2, 0).double().numpy(), texel_middles(self.fit.window, *shape)
        flat = shape[0] * shape[1], places.shape[-1]

        def held(volume: Volume) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            opacity, rgb = shells_of_both(volume, self.fit.chart, uv, places, self.params.layers)
            return 1 - (1 - opacity.reshape(flat)) ** np.float32(GRAZING), rgb.reshape(*flat, 3)

        opacity, rgb = held(self.fit.volume)
        self.state.believe(opacity)
        if fill:
            self.state.fill(opacity, rgb if colours else None)
            for frame in range(self.scene.num_frames):
                splats = self.teacher.moved(frame)
                if splats is not None:
                    opacity, rgb = held(volume_in(self.scene, splats))
                    self.state.fill_frame(frame, opacity, rgb if colours else None)

    def _recentre(self) -> None:
        """Move the layers to where this round found opacity, mean over frames."""
        assert self.state is not None
        h, w = self.state.shape
        n = self.params.layers
        frames = range(self.scene.num_frames)
        alpha = torch.stack([self.state.activated(k)[:, :n, 3].clone() for k in frames]).mean(0)
        seen = self.state.layers[2, :, :n, 3] > 0
        alpha = torch.where(seen, alpha, 0.0).view(1, h, w, -1).permute(0, 3, 1, 2)
        with on_one_thread():
            nodes = torch.nn.functional.interpolate(alpha, size=self.shift.shape, mode="bilinear", align_corners=False)
        found = recentre(self.distances(), nodes[0].permute(1, 2, 0).numpy(), self.params.geometry.blur)
        # Where hardly anything is opaque a direction may drift: not to c, where the search for crossings ends.
        self.shift = _shrink(self.shift + found, self.fit.trust)

    def _step(self, level: TrainingLevel, number: int, live: Live, bar: tqdm) -> None:
        """A level's iterations."""
        assert self.state is not None and self.views is not None
        stride, frames = self._stride(), epochs(self.scene.num_frames, self.random)
        coarse = number < len(self.params.geometry.rounds)
        min_alpha = 0.0 if coarse else MIN_ALPHA
        best, recent = math.inf, math.nan
        for i, frame in zip(range(level.iterations), frames, strict=False):
            views, rays = self.views.part(frame, int(self.random.integers(stride)), stride)
            self.gloss.light(self.state, views, frame)
            if level.last and i >= SETTLING * level.iterations:
                self.pictures.average()
            else:
                self.pictures.shuffle(self.random)
            fall = falling(i / level.iterations if level.last else 0.0)
            rates = rates_of(self.params.textures.learning_rate * fall)
            error = self.state.step(views, rays, self.pictures, frame, min_alpha, rates)
            if not coarse and i % self.params.textures.smooth_every == 0:
                self.state.smooth_alpha(frame)
            recent = error if i == 0 else (1 - SMOOTHING) * recent + SMOOTHING * error
            best = min(best, recent)
            if not recent <= ERROR_RATIO * best + 1e-4:  # NaN, too
                raise _diverged(number, level, self.params.textures.learning_rate)
            if self.gloss.due(i, level):
                done = level.last and i == level.iterations - 1
                self.gloss.fit(self.state, self.views, self.pictures, done)
            self.iteration += 1
            self.rays += len(rays)
            self.psnr = -10 * float(np.log10(max(recent, 1e-12)))
            if i % 10 == 9:
                log_metrics(live, self.iteration, {"psnr": self.psnr, "texel_rows": level.texels[0]})
            bar.update()
            bar.set_postfix(psnr=f"{self.psnr:.2f}", texels=f"{level.texels[0]}x{level.texels[1]}", refresh=False)

    def _stride(self) -> int:
        """Steps look at every so-manieth ray."""
        assert self.state is not None and self.views is not None
        texels = self.state.shape[0] * self.state.shape[1]
        return max(1, int(self.views.count / (self.params.textures.rays_per_texel * texels)))

    def _follow(self) -> None:
        """Frames where they lag behind what moves."""
        assert self.state is not None and self.views is not None
        rates = follow_rates(self.params)
        self.usual, share = follow(self.state, self.views, self.pictures, rates, self.gloss.light)
        self.events.append(fact("followed", share=share))

    def result(self, fingerprint: str) -> tuple[RadianceManifolds, ExplicitSpec]:
        """The model, without the layers that show nothing."""
        assert self.state is not None
        state = self.state
        state.forget_moments()
        state.clear()
        stay = self._kept_layers(state)
        h, w = state.shape
        manifolds = self._manifolds(self.manifolds().maps[..., stay])
        reflection = self.gloss.model()
        textures = GridTextures(self.fit.window, (h, w), len(stay), self.scene.num_frames, reflection)
        with torch.no_grad():
            textures.colour.copy_(state.colour[0].view(h, w, 3))
            textures.layers.copy_(state.layers[0].view(h, w, -1, 4)[:, :, stay])
            textures.frame_colour.copy_(state.frame_colour[0].view(-1, h, w, 3))
            textures.frame_alpha.copy_(state.frame_alpha[0].view(-1, h, w, self.layers)[..., stay])
        spec = ExplicitSpec(
            centre=self.fit.chart.centre,
            belt=self.fit.chart.belt,
            torso=self.fit.torso,
            window=self.fit.window,
            nodes=(self.shift.shape[0], self.shift.shape[1]),
            texels=(h, w),
            num_layers=len(stay),
            num_frames=self.scene.num_frames,
            reflection=None if reflection is None else (*reflection.shape.maps, reflection.shape.environment),
            fingerprint=fingerprint,
        )
        return RadianceManifolds(manifolds, textures), spec

    def _kept_layers(self, state: TextureState) -> list[int]:
        """All but those that show nothing; one of the first surface stays."""
        peak = torch.stack([state.activated(k)[..., 3].amax(0).clone() for k in range(self.scene.num_frames)]).amax(0)
        shows, n = (peak >= LAYER_ALPHA).tolist(), self.params.layers
        kept = [i for i in range(n) if shows[i]] or [n // 2]
        kept += [i for i in range(n, self.layers) if shows[i]]
        gone = sorted(set(range(self.layers)) - set(kept))
        self.events += [fact("layer_dropped", layer=i, alpha=float(peak[i])) for i in gone]
        return kept

    def summary(self, spec: ExplicitSpec) -> dict[str, Any]:
        """`fit.json`: what was chosen, and why."""
        return {
            "window": list(spec.window),
            "middle_radius": {"least": float(self.middle().min()), "greatest": float(self.middle().max())},
            "centre": list(spec.centre),
            "belt": None if spec.belt is None else spec.belt.degrees,
            "halfwidth": {"least": float(self.fit.halfwidth.min()), "greatest": float(self.fit.halfwidth.max())},
            "layers": spec.num_layers,
            "texels": list(spec.texels),
            "reasons": [reason.to_json() for reason in self.fit.reasons],
            "lost_by_chart": {str(chart): loss for chart, loss in self.fit.losses.items()},
            "start_psnr": self.fit.start_psnr,
            "cameras": self.cameras.summary,
            "events": [event.to_json() for event in self.events],
        }


def _diverged(number: int, level: TrainingLevel, rate: float) -> UserError:
    return UserError(
        "training diverged",
        place=f"level {number} ({level.texels[0]} x {level.texels[1]} texels), learning rate {rate:.3g}",
        expected="an error that falls",
        remedy="lower train.textures.learning_rate; if that does not help, check the capture's calibration",
    )


def _shrink(values: NDArray[np.float64], by: NDArray[np.float64]) -> NDArray[np.float64]:
    """Towards 0 by `by`, not beyond."""
    return np.asarray(np.sign(values) * np.clip(np.abs(values) - by, 0, None))
