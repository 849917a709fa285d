"""Training of a take of any length: at once where it fits, else a base from key frames and segments against it."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
from dvclive.live import Live
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import fact
from facefolds_core.files.writing import read_json
from facefolds_core.model.device import CPU
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.segmented import SegmentedTextures
from facefolds_core.model.storage import ExplicitSpec
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.training.checkpoints import fingerprint
from facefolds_core.training.explicit.loop import fit_explicit
from facefolds_core.training.explicit.views import check_images
from facefolds_core.training.log import log_metrics, open_log
from facefolds_core.training.report import Trained, TrainingReport, device_name, make_report, peak_memory
from facefolds_core.training.segments.base import LOG, Base, read_base, train_base
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.forecast import Forecast, check_forecast, forecast, process_bytes, processes_for
from facefolds_core.training.segments.plan import Segment, TakePlan, plan_take
from facefolds_core.training.segments.workers import Fitting, Used, fit_in_processes, fit_segment

_REMEDY = "run the same command again: finished segments are kept"


def train_take(scene: Scene, params: ExplicitParams, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    """`fit_take`, and the model's folder written whole."""
    trained = fit_take(scene, params, checkpoints, log, folder)
    trained.save(folder)
    return trained.report


def fit_take(scene: Scene, params: ExplicitParams, checkpoints: Path, log: Path, place: Path | None = None) -> Trained:
    """Train on a scene of any length, whose subject was found.

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
        return fit_explicit(scene, params, log)
    return _Take(scene, params, checkpoints / "take", log, told).run()


class _Take:
    """A take that is trained in segments."""

    def __init__(self, scene: Scene, params: ExplicitParams, folder: Path, log: Path, told: Forecast) -> None:
        check_images(scene)
        self.scene, self.params, self.folder, self.log = scene, params, folder, log
        self.began = time.perf_counter()
        self.plan = plan_take(scene, params, told.key_frames or 1)
        self.used = Used()

    def run(self) -> Trained:
        base = base_of(self.plan, self.scene, self.params, self.folder, self.log)
        cache = SegmentCache(self.folder)
        self._fit([segment for segment in self.plan.segments if not cache.has(segment.names)], base, cache)
        segments = [segment.names for segment in self.plan.segments]
        psnr = float(np.mean([cache.psnr(frame) for frames in segments for frame in frames]))
        paths = [cache.path(frames) for frames in segments]
        cache.keep_only(paths)
        for other in self.folder.glob("base-*"):
            if other != base.folder and other.is_dir():
                shutil.rmtree(other)
        return self._trained(base, paths, psnr)

    def _fit(self, left: Sequence[Segment], base: Base, cache: SegmentCache) -> None:
        """Fit what is not there, and write each segment as soon as it is whole."""
        frames = sum(len(segment.frames) for segment in left)
        h, w = base.spec.texels
        processes = processes_for(self.scene, self.params, h * w, len(left), frames) if left else 1
        fitting = Fitting(self.scene, self.params, base.folder, self.folder)
        total = len(self.plan.segments)
        with (
            open_log(self.log, resume=True) as live,
            progress(
                total=self.scene.num_frames, initial=self.scene.num_frames - frames, desc="segments", unit="frame"
            ) as bar,
        ):
            log = _SegmentLog(live, self.plan.segments, cache)
            bar.set_postfix(segments=f"{log.there()} of {total}", refresh=False)

            def done(segment: Segment) -> None:
                cache.read(cache.path(segment.names))
                bar.set_postfix(segments=f"{log.there()} of {total}", refresh=False)

            if processes > 1:
                threads = max(1, numba.get_num_threads() // processes)
                memory = processes * process_bytes(self.scene, self.params, h * w) / 1e9
                tqdm.write(
                    f"train: {processes} processes fit segments, threads of each: {threads}; {memory:.1f} GB at most"
                )

                def told(segment: Segment) -> None:
                    bar.update(len(segment.frames))
                    done(segment)

                self.used = fit_in_processes(fitting, base, left, processes, threads, told)
            elif left:
                fitter = fitting.fitter()
                for segment in left:
                    self.used.rays += fit_segment(segment, fitter, cache, bar.update)
                    done(segment)

    def _trained(self, base: Base, paths: Sequence[Path], psnr: float) -> Trained:
        lengths = tuple(len(segment.frames) for segment in self.plan.segments)
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
            int(read_json(base.folder / "training.json", _REMEDY)["iterations"])
            + self.params.segments.steps * self.scene.num_frames,
            device_name(CPU),
            peak_memory(CPU) + sum(self.used.memory.values()),
            self.params.preset,
            self.used.rays,
            psnr,
        )
        report = replace(report, processor_seconds=round(report.processor_seconds + sum(self.used.seconds.values()), 2))
        model = RadianceManifolds(base.manifolds, textures).eval()
        return Trained(model, spec, report, self.params, self._summary(base))

    def _summary(self, base: Base) -> dict[str, Any]:
        """`fit.json`: the base's, and how the take was dealt into segments."""
        found: dict[str, Any] = read_json(base.folder / "fit.json", _REMEDY)
        names = [self.scene.frame_ids[k] for k in self.plan.keys]
        told = fact("in_segments", frames=self.scene.num_frames, segments=len(self.plan.segments), keys=len(names))
        return {**found, "events": [*found["events"], told.to_json()], "key_frames": names}


class _SegmentLog:
    """A line a segment in the training's log, in their order, whoever is done first."""

    def __init__(self, live: Live, segments: Sequence[Segment], cache: SegmentCache) -> None:
        self.live, self.segments, self.cache, self.logged = live, segments, cache, 0

    def there(self) -> int:
        """Log what can be; how many segments are done."""
        has = [self.cache.has(segment.names) for segment in self.segments]
        while self.logged < len(has) and has[self.logged]:
            psnr = float(np.mean([self.cache.psnr(name) for name in self.segments[self.logged].names]))
            log_metrics(self.live, self.logged, {"segment_psnr": psnr})
            self.logged += 1
        return sum(has)


def base_of(plan: TakePlan, scene: Scene, params: ExplicitParams, folder: Path, log: Path) -> Base:
    """The base of a take, trained if it is not in `folder`, and the log of its training."""
    place = folder / f"base-{plan.base}"
    if not place.exists():
        tqdm.write(f"train: the base of {len(plan.keys)} key frames first")
        if any(other.is_dir() for other in folder.glob("base-*")):
            tqdm.write(
                "train: it is another one than before (other key frames, pictures, parameters or code), and all frames "
                "are fitted anew"
            )
        train_base(scene, list(plan.keys), params, place, log)
    shutil.rmtree(log, ignore_errors=True)
    shutil.copytree(place / LOG, log)
    return read_base(place)
