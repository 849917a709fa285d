"""Training of a take of any length: at once where it fits, else a base from key frames and segments against it."""

from __future__ import annotations

import hashlib
import shutil
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from dvclive.live import Live
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import fact
from facefolds_core.files import read_json
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.segmented import SegmentedTextures
from facefolds_core.model.storage import ExplicitSpec
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.training.checkpoints import fingerprint
from facefolds_core.training.device import choose
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.explicit.views import check_images
from facefolds_core.training.log import log_metrics, open_log
from facefolds_core.training.patience import patiently
from facefolds_core.training.report import TrainingReport, make_report
from facefolds_core.training.segments.base import (
    Base,
    digest_of_fitting,
    digest_of_training,
    digests_of_frames,
    fingerprint_of_base,
    read_base,
    train_base,
    with_its_cameras,
)
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.forecast import Forecast, check_forecast, forecast
from facefolds_core.training.segments.frames import FrameFitter
from facefolds_core.training.segments.keys import comparable, farthest_first, likenesses, mixture, named_frames
from facefolds_core.training.trained import Trained

_REMEDY = "run the same command again: finished segments are kept"


def train_take(scene: Scene, params: ExplicitParams, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    """`fit_take`, and the model's folder written whole; a full disk is waited for."""
    trained = fit_take(scene, params, checkpoints, log, folder)
    patiently(lambda: trained.save(folder))
    return trained.report


def fit_take(scene: Scene, params: ExplicitParams, checkpoints: Path, log: Path, place: Path | None = None) -> Trained:
    """Train on a scene of any length.

    Args:
        checkpoints: folder in which base and segments of a long take are kept, so that a later training takes them up.
        log: folder of dvclive's files.
        place: where the model is to be written: that it will fit there is checked before the training.

    Raises:
        UserError: as `fit_explicit`; if memory or disk would not do.
    """
    told = forecast(scene, params)
    check_forecast(told, params, place)
    tqdm.write(f"train: {scene.num_frames} frames {told}")
    if told.key_frames is None:
        return fit_explicit(scene, params, log, place)
    return _Take(scene, params, checkpoints / "take", log, told).run()


class _Take:
    """A take that is trained in segments."""

    def __init__(self, scene: Scene, params: ExplicitParams, folder: Path, log: Path, told: Forecast) -> None:
        check_images(scene)
        self.scene, self.params, self.folder, self.log = scene, params, folder, log
        self.device = choose(params.device)
        self.began = time.perf_counter()
        training = digest_of_training(params)
        frames = progress(range(scene.num_frames), desc="fingerprints", unit="frame")
        digests = digests_of_frames(scene, frames)
        self.parts = likenesses(scene, params.segments)
        named, most = params.segments.named, told.key_frames or 1
        self.keys = named_frames(scene, named) if named else farthest_first(comparable(self.parts), most)
        self.fingerprint = fingerprint_of_base(scene, training, self.keys, digests)
        common = self.fingerprint.encode() + digest_of_fitting(params)
        own = [hashlib.sha256(common + digest).hexdigest()[:16] for digest in digests]
        length = params.segments.frames
        self.segments = [own[k : k + length] for k in range(0, len(own), length)]
        self.rays = self.steps = 0

    def run(self) -> Trained:
        base = self._base()
        scene = with_its_cameras(self.scene, base)
        cache = SegmentCache(self.folder)
        open_segments = [i for i, frames in enumerate(self.segments) if not cache.has(frames)]
        if open_segments:
            fitter = FrameFitter(scene, base, self.params, self.device)
            self._fit(open_segments, fitter, cache)
        psnr = float(np.mean([cache.frames[frame][2] for frames in self.segments for frame in frames]))
        paths = [cache.path(frames) for frames in self.segments]
        cache.keep_only(paths)
        for other in self.folder.glob("base-*"):
            if other != base.folder:
                shutil.rmtree(other)
        return self._trained(base, paths, psnr)

    def _base(self) -> Base:
        folder = self.folder / f"base-{self.fingerprint}"
        if not folder.exists():
            train_base(self.scene, self.keys, self.params, folder, self.log)
        return read_base(folder, self.fingerprint)

    def _fit(self, numbers: Sequence[int], fitter: FrameFitter, cache: SegmentCache) -> None:
        """Fit the frames of the segments that are not there, and write each segment as soon as it is whole."""
        rows = comparable(self.parts, self.keys)
        keys = rows[self.keys]
        length = self.params.segments.frames
        there = self.scene.num_frames - sum(len(self.segments[i]) for i in numbers)
        with (
            open_log(self.log, resume=True) as live,
            progress(total=self.scene.num_frames, initial=there, desc="segments", unit="frame") as bar,
        ):
            for number in numbers:
                fitted = []
                for position, name in enumerate(self.segments[number]):
                    known = cache.frame(name)
                    if known is None:
                        k = number * length + position
                        one = fitter.fit(k, mixture(rows[k], keys, self.params.segments), bytes.fromhex(name))
                        known = one.colour, one.alpha, one.psnr
                        self.rays, self.steps = self.rays + one.rays, self.steps + self.params.segments.steps
                    fitted.append(known)
                    bar.update()
                    bar.set_postfix(segment=f"{number + 1} of {len(self.segments)}", refresh=False)
                cache.write(self.segments[number], fitted)
                self._log(live, number, float(np.mean([one[2] for one in fitted])))

    def _log(self, live: Live, number: int, psnr: float) -> None:
        log_metrics(live, number, {"segment_psnr": psnr})

    def _trained(self, base: Base, paths: Sequence[Path], psnr: float) -> Trained:
        lengths = tuple(len(frames) for frames in self.segments)
        spec = base.spec.model_copy(
            update={
                "num_frames": self.scene.num_frames,
                "segments": lengths,
                "fingerprint": fingerprint(self.params, self.scene),
            }
        )
        assert isinstance(spec, ExplicitSpec)
        shared = base.textures
        textures = SegmentedTextures(spec.window, spec.texels, spec.num_layers, lengths, shared.reflection)
        textures.colour, textures.layers = shared.colour, shared.layers
        textures.attach(paths, _REMEDY)
        report = make_report(
            time.perf_counter() - self.began,
            self.steps,
            self.device.name,
            self.device.peak_memory(),
            self.params.preset,
            self.rays,
            psnr,
        )
        before = read_json(base.folder / "training.json", _REMEDY)
        report = replace(report, iterations=report.iterations + int(before["iterations"]))
        drawn = base.folder / "fit.png"
        picture = drawn.read_bytes() if drawn.exists() else None
        return Trained(
            RadianceManifolds(base.manifolds, textures).eval(),
            spec,
            report,
            self._summary(base),
            None if picture is None else partial(_write, picture),
        )

    def _summary(self, base: Base) -> dict[str, Any]:
        """`fit.json`: the base's, and how the take was dealt into segments."""
        found: dict[str, Any] = read_json(base.folder / "fit.json", _REMEDY)
        names = [self.scene.frame_ids[k] for k in self.keys]
        told = fact("in_segments", frames=self.scene.num_frames, segments=len(self.segments), keys=len(names))
        return {**found, "events": [*found["events"], told.to_json()], "key_frames": names}


def _write(content: bytes, path: Path) -> None:
    path.write_bytes(content)
