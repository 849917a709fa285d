"""What a worker process needs, handed to it as files without a name: it holds what its parent does, not a copy."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.training.device import choose
from facefolds_core.training.explicit.views import Views, trace_views
from facefolds_core.training.segments.base import Base, read_base, with_its_cameras
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.frames import FrameFitter


@dataclass(frozen=True)
class Fitting:
    """By what segments are fitted.

    Attributes:
        scene: as it was given to the training.
        params: of the training.
        base: its folder.
        fingerprint: of the base.
        folder: of the segments.
    """

    scene: Scene
    params: ExplicitParams
    base: Path
    fingerprint: str
    folder: Path

    def fitter(self, views: Views | None = None) -> FrameFitter:
        """Args: `views`: crossings of the rays of a still head, if they are known."""
        base = read_base(self.base, self.fingerprint)
        return FrameFitter(with_its_cameras(self.scene, base), base, self.params, choose(self.params.device), views)

    def cache(self) -> SegmentCache:
        return SegmentCache(self.folder)


@contextmanager
def handed(fitting: Fitting, base: Base) -> Iterator[list[int]]:
    """Handles of open files, the first one's content a pickle; of a still head the crossings of its rays, too."""
    with ExitStack() as stack:
        shapes: dict[str, tuple[int, str, tuple[int, ...]]] = {}
        if fitting.scene.poses is None:
            views = trace_views(with_its_cameras(fitting.scene, base), base.manifolds, 1)
            for field in fields(views):
                array = getattr(views, field.name)
                file = stack.enter_context(TemporaryFile())
                array.tofile(file)
                shapes[field.name] = (file.fileno(), array.dtype.str, array.shape)
            del views
        about = stack.enter_context(TemporaryFile())
        pickle.dump((fitting, shapes), about)
        about.flush()
        yield [about.fileno(), *(handle for handle, _, _ in shapes.values())]


def taken(handle: int) -> tuple[Fitting, Views | None]:
    """In the worker: what was handed to it, arrays mapped."""
    fitting, shapes = pickle.loads(os.pread(handle, os.fstat(handle).st_size, 0))
    if not shapes:
        return fitting, None
    arrays = {}
    for name, (number, dtype, shape) in shapes.items():
        with os.fdopen(number, "rb") as file:
            # "c": kernels are compiled for arrays that can be written to.
            arrays[name] = np.memmap(file, dtype, "c", shape=shape).view(np.ndarray)
    return fitting, Views(**arrays)
