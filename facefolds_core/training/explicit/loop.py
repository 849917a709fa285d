"""Training of the explicit model: geometry in rounds at coarse textures, then textures coarse to fine on stored
crossings. Under two minutes, so that an interrupted run simply starts again."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from dvclive.live import Live
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files import atomic_folder, write_json
from facefolds_core.model.grids import GridTextures
from facefolds_core.model.radial import RadialManifolds
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import ExplicitSpec, save_model
from facefolds_core.params import TrainParams
from facefolds_core.progress import progress
from facefolds_core.training.checkpoints import fingerprint
from facefolds_core.training.explicit.background import first_background
from facefolds_core.training.explicit.cameras import CameraChoice, choose_cameras
from facefolds_core.training.explicit.fit import ROUNDS, Fit, fit_scene, least_middle, recentre
from facefolds_core.training.explicit.picture import draw_fit
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.views import Images, Views, check_images, trace_views
from facefolds_core.training.log import open_log
from facefolds_core.training.report import TrainingReport, make_report, pick_device
from facefolds_core.training.volume.fit import Volume, fit_volume, iterations
from facefolds_core.training.volume.subject import subject_of

RAYS_PER_TEXEL = 2.5
"""Of one frame, in one step."""

ROUND_ITERATIONS = 60
"""Of each round of geometry, at a quarter of the final texels a side."""

LEAST_ITERATIONS = ROUND_ITERATIONS * len(ROUNDS) + 3
"""That are run even if fewer are asked for: all rounds, and a few with the final geometry."""

HALF_SHARE = 0.4
"""Of the remaining iterations, at half of the final texels a side; the others are at full resolution."""

RATE_LAYERS, RATE_ALPHA, RATE_FRAME = 0.3, 15.0, 0.5
"""Learning rates of the layers' own colours, of the logits of alpha, and of the frames' parts, against the colours'."""

KEEP_FRAMES = 0.999
"""The frames' parts shrink by this factor each step towards what is shared."""

SMOOTH_EVERY = 3
"""Steps between smoothings of opacity over neighbouring texels, at half and full resolution."""

BACKGROUND_RATE = 0.5
FAINT = 0.002
"""Layers with less alpha are skipped once the textures are at half resolution."""

LATE_VEIL = 0.1
"""Once it is decided what the background explains, the price of opacity falls to this part, and rays that are nearly
opaque are pressed to be so."""

BLUR = 6.0
"""Smoothing of the layers' motion between rounds of geometry, nodes of the radius maps."""

EPSILON = 1 / 255
"""A layer whose alpha is nowhere larger is dropped: no pixel changes by more than this."""

LEAST = 1 / 1020
"""Texels that add less to the opacity of every training ray that was looked at (in each frame one ray in several, some
RAYS_PER_TEXEL a texel; all of them over the frames) are made transparent. A ray reads four a layer: its colour changes
by no more than N / 255, and that only if all of them are just below."""

BESIDE = 0.1
"""Directions in which the volume is less opaque lie beside the subject: what was painted there is room."""

DIVERGED = 9.0
"""A mean squared error this many times the best of its level is a divergence."""

ATTEMPTS = 4


@dataclass(frozen=True)
class Level:
    """One stretch of training.

    Attributes:
        texels: (H, W).
        iterations: steps.
        stride: of the pixels that are traced.
        geometry: halfwidths of the layers, in those of the fit.
        last: the learning rates fall to a tenth along it.
    """

    texels: tuple[int, int]
    iterations: int
    stride: int
    geometry: float
    last: bool


def plan(fit: Fit, iterations: int) -> list[Level]:
    """Rounds of geometry, quarter, half and full resolution."""

    def size(divisor: int) -> tuple[int, int]:
        return max(16, fit.texels[0] // divisor), max(16, fit.texels[1] // divisor)

    levels = [Level(size(4), ROUND_ITERATIONS, 8, scale, False) for scale in ROUNDS]
    rest = max(iterations, LEAST_ITERATIONS) - ROUND_ITERATIONS * len(levels)
    half = round(HALF_SHARE * rest)
    levels.append(Level(size(2), half, 1, ROUNDS[-1], False))
    levels.append(Level(fit.texels, rest - half, 1, ROUNDS[-1], True))
    return levels


def train_explicit(scene: Scene, params: TrainParams, model_folder: Path, log: Path) -> TrainingReport:
    """Train on `scene` and write the model folder whole.

    Raises:
        UserError: if an image is missing, nothing stands out from the background, or training diverges even at small
            learning rates.
    """
    check_images(scene)
    device = pick_device(params.device)
    began = time.perf_counter()
    with open_log(log) as live:
        bar = progress(total=iterations() + params.iterations, desc="train", unit="it")
        volume = subject_of(fit_volume(scene, params.seed, params.lr_volume, bar))
        cameras = choose_cameras(scene, volume.cameras)
        for note in cameras.notes:
            bar.write(f"train: {note}")
        fit = fit_scene(cameras.scene, volume, params.level_halfwidth)
        for note in fit.notes:
            bar.write(f"train: {note}")
        trainer = _Trainer(cameras, params, fit, volume, device)
        levels = plan(fit, params.iterations)
        for k, level in enumerate(levels):
            trainer.run(level, k, live, bar)
        bar.close()
    model, spec = trainer.result(fingerprint(params, scene))
    report = make_report(
        time.perf_counter() - began, trainer.iteration, device, params.preset, trainer.rays, trainer.psnr
    )
    with atomic_folder(model_folder) as temporary:
        save_model(model, spec, temporary)
        write_json(temporary / "training.json", asdict(report))
        write_json(temporary / "fit.json", trainer.summary(spec))
        draw_fit(temporary / "fit.png", fit, spec.num_layers)
    return report


class _Trainer:
    def __init__(
        self, cameras: CameraChoice, params: TrainParams, fit: Fit, volume: Volume, device: torch.device
    ) -> None:
        self.cameras, self.params, self.fit, self.volume, self.device = cameras, params, fit, volume, device
        self.scene = cameras.scene
        self.images = Images(self.scene, cameras.gains)
        self.random = np.random.default_rng(params.seed)
        self.middle = torch.from_numpy(fit.middle).float()
        self.geometry = 0.0
        x, y, z = (float(v) for v in fit.centre)
        self.centre = (x, y, z)
        self.views: Views | None = None
        self.stride = 0
        self.state: TextureState | None = None
        self.iteration = self.rays = 0
        self.rate = params.lr_texture
        self.psnr = 0.0
        self.events = list(cameras.notes)

    def manifolds(self) -> RadialManifolds:
        halfwidth = self.geometry * torch.from_numpy(self.fit.halfwidth).float()
        return RadialManifolds(self.centre, self.fit.window, self.middle, halfwidth, self.params.layers)

    def run(self, level: Level, number: int, live: Live, bar: tqdm) -> None:
        """One level, again from its start at a third of the learning rate if it diverges."""
        self._prepare(level)
        assert self.state is not None and self.views is not None
        saved = self.state.snapshot()
        for _ in range(ATTEMPTS):
            if self._attempt(level, number, live, bar):
                return
            self.state.restore(saved)
            self.rate /= 3
            self.events.append(f"level {number}: diverged, begun again with learning rate {self.rate:.3g}")
            bar.write(f"train: {self.events[-1]}")
        raise UserError(
            "training diverged",
            place=f"level {number} ({level.texels[0]} x {level.texels[1]} texels), learning rate {self.rate:.3g}",
            expected="an error that falls",
            remedy="lower train.lr_texture; if that does not help, check the capture's calibration",
        )

    def _prepare(self, level: Level) -> None:
        """Geometry, stored crossings and grids of this level."""
        moved = self.geometry != level.geometry
        if moved and self.state is not None:
            self._recentre()
        self.geometry = level.geometry
        if moved or self.stride != level.stride:
            self.views = trace_views(self.scene, self.manifolds(), level.stride)
            self.stride = level.stride
        assert self.views is not None
        if self.state is None:
            background = first_background(self.scene, self.images, self.volume)
            start = torch.from_numpy(np.concatenate([self.fit.rgb, self.fit.opacity[..., None]], -1)).float()
            shape = (self.params.layers, self.scene.num_frames)
            self.state = TextureState(level.texels, *shape, start, background, self.device)
        elif self.state.shape != level.texels:
            self.state.grow(level.texels)
        if moved:
            self.state.reset_alpha()

    def _recentre(self) -> None:
        """Move the middle radius to where this round found opacity, mean over frames."""
        assert self.state is not None
        h, w = self.state.shape
        alpha = torch.stack([self.state.activated(k)[..., 3].clone() for k in range(self.scene.num_frames)]).mean(0)
        seen = self.state.layers[2, ..., 3] > 0
        alpha = torch.where(seen, alpha, 0.0).view(1, h, w, -1).permute(0, 3, 1, 2).cpu()
        nodes = torch.nn.functional.interpolate(
            alpha, size=tuple(self.middle.shape), mode="bilinear", align_corners=False
        )
        radii = self.manifolds().radii().detach().double().numpy()
        moved = self.middle + torch.from_numpy(recentre(radii, nodes[0].permute(1, 2, 0).numpy(), BLUR)).float()
        start = torch.from_numpy(self.fit.middle).float()
        # Where hardly anything is opaque a direction may drift: not to c, where the search for crossings ends.
        moved = start + _shrink(moved - start, torch.from_numpy(self.fit.trust).float())
        self.middle = torch.maximum(moved, torch.from_numpy(least_middle(self.fit.halfwidth)).float())

    def _attempt(self, level: Level, number: int, live: Live, bar: tqdm) -> bool:
        """All iterations of a level; False if it diverges."""
        assert self.state is not None and self.views is not None
        count, stride = len(self.views.pixel), self._stride()
        coarse = number < len(ROUNDS)
        best, recent = float("inf"), float("nan")
        for i in range(level.iterations):
            frame = int(self.random.integers(self.scene.num_frames))
            rays = np.arange(int(self.random.integers(stride)), count, stride)
            rates = self._rates(i / level.iterations if level.last else 0.0)
            error = self.state.step(
                self.views,
                rays,
                self.images.frame(frame),
                frame,
                self.params.lambda_veil * (1.0 if coarse else LATE_VEIL),
                0.0 if coarse else self.params.lambda_solid,
                BACKGROUND_RATE,
                0.0 if coarse else FAINT,
                rates,
                KEEP_FRAMES,
            )
            if not coarse and i % SMOOTH_EVERY == 0:
                self.state.smooth_alpha(frame)
            recent = error if i == 0 else 0.9 * recent + 0.1 * error
            best = min(best, recent)
            if not np.isfinite(error) or recent > DIVERGED * best + 1e-4:
                return False
            self.iteration += 1
            self.rays += len(rays)
            self.psnr = -10 * float(np.log10(max(recent, 1e-12)))
            if i % 10 == 9:
                live.step = self.iteration
                live.log_metric("psnr", self.psnr)
                live.log_metric("texel_rows", level.texels[0])
            bar.update()
            bar.set_postfix(psnr=f"{self.psnr:.2f}", texels=f"{level.texels[0]}x{level.texels[1]}", refresh=False)
        return True

    def _stride(self) -> int:
        """Steps look at every so-manieth ray."""
        assert self.state is not None and self.views is not None
        return max(1, int(len(self.views.pixel) / (RAYS_PER_TEXEL * self.state.shape[0] * self.state.shape[1])))

    def _rates(self, progress: float) -> NDArray[np.float32]:
        rate = self.rate * (1 - 0.9 * progress)
        rates = rate * np.array([1, RATE_LAYERS, RATE_ALPHA, RATE_FRAME, RATE_FRAME * RATE_ALPHA])
        return rates.astype(np.float32)

    def result(self, mark: str) -> tuple[RadianceManifolds, ExplicitSpec]:
        """The model, without the layers that show nothing."""
        assert self.state is not None
        state, n = self.state, self.params.layers
        state.forget_moments()
        assert self.views is not None
        hidden = (state.contributions(self.views, self._stride()) < LEAST) | state.beside(BESIDE)
        state.hide(hidden)
        self.events.append(
            f"{float(hidden.float().mean()):.0%} of all texels cleared: they add less than {LEAST:.5f} to any ray, "
            "or lie beside the subject"
        )
        peak = torch.stack([state.activated(k)[..., 3].amax(0).clone() for k in range(self.scene.num_frames)]).amax(0)
        kept = [i for i in range(n) if float(peak[i]) >= EPSILON] or [n // 2]
        # Layers stay where they are: the ones kept must still be evenly spaced, so only outer and inner ones go.
        first, last = kept[0], kept[-1]
        self.events += [
            f"layer {i} dropped: alpha at most {float(peak[i]):.4f}" for i in range(n) if not first <= i <= last
        ]
        radii = self.manifolds().radii().detach()
        outer, inner = radii[..., first], radii[..., last]
        h, w = state.shape
        halfwidth = (0.5 * (outer - inner)).clamp(min=1e-6)
        manifolds = RadialManifolds(self.centre, self.fit.window, 0.5 * (outer + inner), halfwidth, last - first + 1)
        textures = GridTextures(self.fit.window, (h, w), last - first + 1, self.scene.num_frames)
        with torch.no_grad():
            textures.colour.copy_(state.colour[0].view(h, w, 3))
            textures.layers.copy_(state.layers[0].view(h, w, n, 4)[:, :, first : last + 1])
            textures.frame_colour.copy_(state.frame_colour[0].view(-1, h, w, 3))
            textures.frame_alpha.copy_(state.frame_alpha[0].view(-1, h, w, n)[..., first : last + 1])
        spec = ExplicitSpec(
            centre=self.centre,
            window=self.fit.window,
            nodes=(self.middle.shape[0], self.middle.shape[1]),
            texels=(h, w),
            num_layers=last - first + 1,
            num_frames=self.scene.num_frames,
            fingerprint=mark,
        )
        return RadianceManifolds(manifolds, textures), spec

    def summary(self, spec: ExplicitSpec) -> dict[str, object]:
        """`fit.json`: what was chosen, and why."""
        return {
            "window": list(spec.window),
            "middle_radius": {"least": float(self.middle.min()), "greatest": float(self.middle.max())},
            "centre": list(spec.centre),
            "halfwidth": {"least": float(self.fit.halfwidth.min()), "greatest": float(self.fit.halfwidth.max())},
            "layers": spec.num_layers,
            "texels": list(spec.texels),
            "reasons": list(self.fit.reasons),
            "lost_by_centre": {f"{x:.2f}": loss for x, loss in self.fit.losses.items()},
            "volume_psnr": self.fit.volume_psnr,
            "cameras": self.cameras.summary,
            "events": self.events,
        }


def _shrink(values: torch.Tensor, by: torch.Tensor) -> torch.Tensor:
    """Towards 0 by `by`, not beyond."""
    return values.sign() * (values.abs() - by).clamp(min=0)
