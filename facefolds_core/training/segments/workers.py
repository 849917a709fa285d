"""Segments fitted and written, in this process or shared out among several of this machine (loky); those that a lost
process had are fitted again."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from loky import ProcessPoolExecutor
from loky.process_executor import BrokenProcessPool
from numpy.typing import NDArray
from tqdm import tqdm

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams
from facefolds_core.system.processes import end_with_parent, with_threads
from facefolds_core.training.explicit.views import Views, trace_views
from facefolds_core.training.segments.base import Base, read_base, with_its_cameras
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.frames import FrameFitter, shine_of
from facefolds_core.training.segments.plan import Segment

RAYS = "rays-"
"""Before the name of a folder, beside the segments, with what all processes map into memory."""

SHINE = "shine"


@dataclass(frozen=True)
class Fitting:
    """By what segments are fitted.

    Attributes:
        scene: as it was given to the training.
        params: of the training.
        base: its folder.
        folder: of the segments.
    """

    scene: Scene
    params: ExplicitParams
    base: Path
    folder: Path

    def fitter(self, views: Views | None = None, shine: NDArray[np.float32] | None = None) -> FrameFitter:
        """Args: of a still head, if they are known, `views`: crossings of its rays, `shine`: see `FrameFitter`."""
        base = read_base(self.base)
        return FrameFitter(with_its_cameras(self.scene, base), base, self.params, views, shine)


def fit_segment(
    segment: Segment, fitter: FrameFitter, cache: SegmentCache, tell: Callable[[], object] = lambda: None
) -> int:
    """Fit its frames but for those that are in the cache, and write its file.

    Args:
        tell: hears of each frame that is done.

    Returns:
        rays that were shaded.

    Raises:
        UserError: if a frame diverges.
    """
    fitted, rays = [], 0
    for frame, name, shares in zip(segment.frames, segment.names, segment.shares, strict=True):
        known = cache.frame(name)
        if known is None:
            known, shaded = fitter.fit(frame, np.array(shares), bytes.fromhex(name))
            rays += shaded
        fitted.append(known)
        tell()
    cache.write(segment.names, fitted)
    return rays


@dataclass
class Used:
    """What a training in processes used.

    Attributes:
        rays: shaded.
        memory: process -> bytes resident in it at most.
        seconds: process -> of processor.
    """

    rays: int = 0
    memory: dict[int, int] = field(default_factory=dict)
    seconds: dict[int, float] = field(default_factory=dict)


def fit_in_processes(
    fitting: Fitting,
    base: Base,
    segments: Sequence[Segment],
    count: int,
    threads: int,
    tell: Callable[[Segment], object],
) -> Used:
    """Fit segments in `count` processes. Where one is lost there are fewer: the memory may have been too small.

    Args:
        threads: of each process.
        tell: hears of each segment that is done.

    Raises:
        UserError: if a frame diverges, or a process is lost again before another segment is done.
    """
    left, used, lost = list(segments), Used(), False
    with _handed(fitting, base) as rays:
        while left:
            try:
                for segment in _fitted(fitting, rays, left, count, threads, used):
                    left.remove(segment)
                    tell(segment)
                    lost = False
            except BrokenProcessPool as error:
                if lost:
                    raise _lost(left, error) from None
                lost, count = True, max(1, count - 1)
                tqdm.write(f"train: a process was lost, {len(left)} segments are left; {count} at once from here on")
    return used


def _fitted(
    fitting: Fitting, rays: Path | None, segments: Sequence[Segment], count: int, threads: int, used: Used
) -> Iterator[Segment]:
    """Segments as they are done; whatever ends this ends the processes."""
    pool = ProcessPoolExecutor(min(count, len(segments)), initializer=_begin, env=with_threads(threads))
    try:
        todo = {pool.submit(_fit, fitting, rays, segment): segment for segment in segments}
        for future in as_completed(todo):
            number, shaded, memory, seconds = future.result()
            used.rays += shaded
            used.memory[number], used.seconds[number] = memory, seconds
            yield todo[future]
    finally:
        pool.shutdown(kill_workers=True)


def _begin() -> None:
    """In each process, first."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C reaches the parent, too, which ends us
    end_with_parent()


def _fit(fitting: Fitting, rays: Path | None, segment: Segment) -> tuple[int, int, int, float]:
    """In a process: which one it is, rays shaded for the segment; bytes and seconds of the process until now."""
    shaded = fit_segment(segment, *_means(fitting, rays))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return os.getpid(), shaded, memory, time.process_time()


_made: dict[Path, tuple[FrameFitter, SegmentCache]] = {}


def _means(fitting: Fitting, rays: Path | None) -> tuple[FrameFitter, SegmentCache]:
    """What fits a take's segments in this process, made once."""
    if fitting.base not in _made:
        _made[fitting.base] = fitting.fitter(*_taken(rays)), SegmentCache(fitting.folder)
    return _made[fitting.base]


@contextmanager
def _handed(fitting: Fitting, base: Base) -> Iterator[Path | None]:
    """A folder with the crossings of a still head's rays, which all processes map; None of a head that turns."""
    for old in fitting.folder.glob(f"{RAYS}*"):  # of a training that was killed
        shutil.rmtree(old, ignore_errors=True)
    if fitting.scene.poses is not None:
        yield None
        return
    with TemporaryDirectory(prefix=RAYS, dir=fitting.folder) as folder:
        views = trace_views(with_its_cameras(fitting.scene, base), base.manifolds, 1)
        np.save(Path(folder) / f"{SHINE}.npy", shine_of(base, fitting.params, views))
        for name, array in vars(views).items():
            np.save(Path(folder) / f"{name}.npy", array)
        del views, array
        yield Path(folder)


def _taken(folder: Path | None) -> tuple[Views | None, NDArray[np.float32] | None]:
    """In a process: what was handed to it, arrays mapped."""
    if folder is None:
        return None, None
    arrays: dict[str, Any] = {path.stem: _mapped(path) for path in folder.glob("*.npy")}
    shine = arrays.pop(SHINE)
    return Views(**arrays), shine


def _mapped(path: Path) -> Any:
    try:
        # "c": kernels are compiled for arrays that can be written to.
        return np.load(path, mmap_mode="c").view(np.ndarray)
    except ValueError:  # an array without elements cannot be mapped
        return np.load(path)


def _lost(left: Sequence[Segment], error: BrokenProcessPool) -> UserError:
    return UserError(
        "a worker process was lost, and the one that took its work, too",
        place=f"one of the segments {', '.join(str(segment.number + 1) for segment in left)}",
        found=str(error).splitlines()[0],
        remedy="run the same command again, which goes on from here; with `train.segments.processes: 1` segments are "
        "fitted in the training's own process",
    )
