"""The shared reflection along a training: when it is fitted, to what, and whether it stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.sphere_uv import Window
from facefolds_core.geometry.track import Track
from facefolds_core.model.reflection import Reflection
from facefolds_core.params import ReflectionParams
from facefolds_core.spacing import spread
from facefolds_core.subject.outline import grid_shape
from facefolds_core.training.explicit.plan import TrainingLevel
from facefolds_core.training.explicit.reflection import (
    GLOSS,
    GlossMethod,
    centred,
    fit_maps,
    gain_on_cameras,
    grounded,
)
from facefolds_core.training.explicit.reflection_maps import Maps, SeenRays, surface_normals
from facefolds_core.training.explicit.state import TextureState
from facefolds_core.training.explicit.targets import CutOuts
from facefolds_core.training.explicit.views import RaySource, StillRays, Views


class GlossFit:
    """Fits the reflection to what the textures leave over, and gives the textures' rays what it adds.

    Attributes:
        maps: as fitted last; None before the first fit, and where there is no reflection.
        on: whether there is one.
        smoother: how many times as smooth as usual its maps are: 1, or what `how` has where that helps.

    Args:
        poses: of a head that turns, in the frames of the training: the reflection of a ray is another one in each.
        how: it is fitted.
        photographed: cameras of which there are photos, the first ones; others show no gloss. None: all.
    """

    def __init__(
        self,
        chart: Chart,
        window: Window,
        params: ReflectionParams,
        poses: Track | None,
        how: GlossMethod = GLOSS,
        photographed: int | None = None,
    ) -> None:
        self._photographed = photographed
        self.chart, self.window, self.params, self.poses, self.how = chart, window, params, poses, how
        self.on, self.smoother = params.enabled, 1.0
        self.maps: Maps | None = None
        self._normals: NDArray[np.float32] | None = None

    def follow(self, state: TextureState, source: RaySource, pictures: CutOuts, middle: torch.Tensor) -> None:
        """New crossings, and perhaps a new middle radius: normals, and what the reflection adds to each ray."""
        if not self.on:
            return
        radii, shape = middle.cpu().numpy().astype(np.float64), grid_shape(self.window, self.params.texels, 2)
        self._normals = surface_normals(radii, self.chart, self.window, shape, self.how.normal_blur)
        if self.maps is not None:
            self.maps = replace(self.maps, surface=self._normals)
            if self.poses is None:
                self._shine(state, self.look(state, source, pictures))

    def light(self, state: TextureState, views: Views, frame: int) -> None:
        """Before a step on the rays of one frame: what the reflection adds to each, if they are others in each frame.

        They reflect where they cross the layer nearest to the middle one."""
        if self.poses is None or self.maps is None:
            return
        state.shine = self.maps.on_rays(views, self.poses.at(frame).rotation)

    def due(self, step: int, level: TrainingLevel) -> bool:
        """Whether to fit after this step of a level: `fits` times, the last after its last one."""
        fits, steps = self.params.fits, level.iterations
        return self.on and self.params.begin == "rounds" and (step + 1) * fits // steps > step * fits // steps

    def after(self, number: int, rounds: int, state: TextureState, source: RaySource, pictures: CutOuts) -> Fact | None:
        """After level `number`, of which `rounds` are of geometry: where it is time, whether there is one; with
        `begin: end` it is fitted now."""
        if not self.on or number != (rounds - 1 if self.params.begin == "rounds" else rounds + 1):
            return None
        seen = self.look(state, source, pictures)
        found = self._decide(state, seen)
        if self.on and self.params.begin == "end":
            self._fit(state, seen, done=True)
        return found

    def fit(self, state: TextureState, source: RaySource, pictures: CutOuts, done: bool) -> None:
        """Fit to what the textures leave over now; `done` if they are trained no more."""
        self._fit(state, self.look(state, source, pictures), done)

    def _fit(self, state: TextureState, seen: SeenRays, done: bool) -> None:
        used = self._used(seen)
        if not np.isfinite(used.residual).all():
            return  # the textures diverge: the next step says so
        if not len(used.st):
            return  # nothing is opaque yet: a gloss of 0 would stay 0
        first = self.maps is None
        assert self._normals is not None
        start = Maps.blank(self._normals, self.params) if first else self.maps
        assert start is not None
        rounds = self.how.first_rounds if first else self.how.rounds
        maps = grounded(fit_maps(used, start, rounds, self.how, self.smoother))
        # Textures that are still trained would follow an offset that takes up what they leave over.
        self.maps = maps if done else centred(maps, used, self.how, self.smoother)
        self._shine(state, seen)

    def _decide(self, state: TextureState, seen: SeenRays) -> Fact:
        """Whether the reflection helps on cameras that its fit did not see, or a smoother one does more: it is fitted
        anew then. If neither does there is none from here on."""
        assert self._normals is not None
        start, used, least = Maps.blank(self._normals, self.params), self._used(seen), self.how.min_gain
        gain = smooth = gain_on_cameras(used, start, self.how)
        if gain < self.how.sure_gain:
            smooth = gain_on_cameras(used, start, self.how, self.how.smoother)
        if gain >= max(least, smooth):
            return fact("reflection", gain=gain, least=least)
        begun, self.maps, state.shine = self.maps is not None, None, np.zeros((0, 3), np.float32)
        self.on = smooth >= least
        if not self.on:
            return fact("no_reflection", gain=max(gain, smooth), least=least)
        self.smoother = self.how.smoother
        if begun:
            self._fit(state, seen, done=False)
        return fact("smooth_reflection", gain=smooth, fine=gain, least=least, times=self.smoother)

    def model(self) -> Reflection | None:
        """What the model gets."""
        return None if self.maps is None else self.maps.model()

    def look(self, state: TextureState, source: RaySource, pictures: CutOuts) -> SeenRays:
        """What textures leave over, on rays for a fit."""
        if self.poses is not None:
            return self._look_in_turns(state, source, pictures, self.poses)
        assert isinstance(source, StillRays)
        views = source.views
        sums = np.zeros((len(views.pixel), 6), np.float32)
        frames = spread(range(len(state.steps)), self.how.frames)
        for frame in frames:
            state.look(views, pictures, frame, sums)
        return SeenRays.of(views.camera, views.directions, sums, len(frames)).filled(views)

    def _look_in_turns(self, state: TextureState, source: RaySource, pictures: CutOuts, poses: Track) -> SeenRays:
        """Of some rays of each of some frames, as many as a fit takes: in each frame the room shines from elsewhere.

        Frames are looked at twice. What all their rays see would take up to a gigabyte; how many are opaque, and so
        which ones are taken, is not known before the last frame.
        """
        frames = spread(range(len(state.steps)), self.how.moving_frames)
        opaque, before, found = [], 0, []
        for frame in frames:
            views, _ = source.part(frame, 0, 1)
            sums = _seen(state, views, pictures, frame)
            opaque.append(np.flatnonzero(sums[:, 3] >= self.how.min_opacity).astype(np.int32))
        step = self._step(sum(map(len, opaque)))
        for frame, there in zip(frames, opaque, strict=True):
            views = source.part(frame, 0, 1)[0].part(there[-before % step :: step])
            before += len(there)
            turn = np.asarray(poses.at(frame).rotation, np.float32)
            found.append(SeenRays.of(views.camera, views.directions, _seen(state, views, pictures, frame), 1, turn))
        return SeenRays.together(found)

    def _used(self, seen: SeenRays) -> SeenRays:
        """The rays of a fit."""
        counts = seen.opacity >= self.how.min_opacity
        if self._photographed is not None:
            counts &= seen.camera < self._photographed
        opaque = np.flatnonzero(counts)
        return seen.part(opaque[:: self._step(len(opaque))])

    def _step(self, count: int) -> int:
        """One of so many of `count` rays is used."""
        return max(1, -(-count // self.how.rays))

    def _shine(self, state: TextureState, seen: SeenRays) -> None:
        assert self.maps is not None
        if self.poses is None:
            state.shine = self.maps.added(seen)


def _seen(state: TextureState, views: Views, pictures: CutOuts, frame: int) -> NDArray[np.float32]:
    """(P, 6) what rays see in one frame, as `TextureState.look` gives it."""
    sums = np.zeros((len(views.pixel), 6), np.float32)
    state.look(views, pictures, frame, sums)
    return sums
