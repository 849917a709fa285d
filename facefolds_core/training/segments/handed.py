"""What a worker process needs, handed to it as files without a name: it holds what its parent does, not a copy."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.model.device import device_of
from facefolds_core.params import ExplicitParams
from facefolds_core.training.explicit.views import Views, trace_views
from facefolds_core.training.segments.base import Base, read_base, with_its_cameras
from facefolds_core.training.segments.cache import SegmentCache
from facefolds_core.training.segments.frames import FrameFitter, shine_of

SHINE = "shine"


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

    def fitter(self, views: Views | None = None, shine: NDArray[np.float32] | None = None) -> FrameFitter:
        """Args: of a still head, if they are known, `views`: crossings of its rays, `shine`: see `FrameFitter`."""
        base, device = read_base(self.base, self.fingerprint), device_of(self.params)
        return FrameFitter(with_its_cameras(self.scene, base), base, self.params, device, views, shine)

    def cache(self) -> SegmentCache:
        return SegmentCache(self.folder)


@contextmanager
def handed(fitting: Fitting, base: Base) -> Iterator[list[int]]:
    """Handles of open files, the first one's content a pickle; of a still head the crossings of its rays, too."""
    with ExitStack() as stack:
        shapes: dict[str, tuple[int, str, tuple[int, ...]]] = {}
        if fitting.scene.poses is None:
            views = trace_views(with_its_cameras(fitting.scene, base), base.manifolds, 1)
            for name, array in (*vars(views).items(), (SHINE, shine_of(base, fitting.params, views))):
                file = stack.enter_context(TemporaryFile())
                array.tofile(file)
                shapes[name] = (file.fileno(), array.dtype.str, array.shape)
            del views, array
        about = stack.enter_context(TemporaryFile())
        pickle.dump((fitting, shapes), about)
        about.flush()
        yield [about.fileno(), *(handle for handle, _, _ in shapes.values())]


def taken(handle: int) -> tuple[Fitting, Views | None, NDArray[np.float32] | None]:
    """In the worker: what was handed to it, arrays mapped."""
    fitting, shapes = pickle.loads(os.pread(handle, os.fstat(handle).st_size, 0))
    if not shapes:
        return fitting, None, None
    arrays = {}
    for name, (number, dtype, shape) in shapes.items():
        with os.fdopen(number, "rb") as file:
            # "c": kernels are compiled for arrays that can be written to. An empty file cannot be mapped.
            mapped = np.memmap(file, dtype, "c", shape=shape) if np.prod(shape) else np.zeros(shape, dtype)
            arrays[name] = mapped.view(np.ndarray)
    shine = arrays.pop(SHINE)
    return fitting, Views(**arrays), shine
