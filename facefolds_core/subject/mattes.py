"""Where the subject is in each picture: as the user or the capture says, beside a clean plate, or as its Gaussians and
the picture's colours say."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from threading import RLock
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from facefolds_core.captures.cutout import cut_from
from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.torso import Torso
from facefolds_core.spacing import spread
from facefolds_core.subject.body import pictures
from facefolds_core.subject.cut_out import (
    Array,
    Bool,
    Colours,
    Image,
    agreement,
    colours_of,
    cut_out,
    softened,
)
from facefolds_core.subject.drawing import draw, view_of
from facefolds_core.subject.fit import TargetPicture, target_of
from facefolds_core.subject.found import background, opacity_of, reference_frame
from facefolds_core.subject.plates import Expectation, from_plate
from facefolds_core.subject.splats import Splats
from facefolds_core.subject.standing import farthest_moved, if_still, in_frame, standing, torso_of
from facefolds_core.subject.storage import Body
from facefolds_core.system.threads import in_order

Key = tuple[int, int]
"""(camera, frame) in the scene."""
Source = Literal["capture", "named", "plate", "picture", "gaussians"]
"""Whence a matte is: it came with the capture, the user has named it, or it was found: beside a plate, in the picture,
or, where the picture contradicts the others, from their Gaussians alone."""

ASKED = 0.8
"""IoU of a silhouette with the Gaussians', under which the picture is asked once more, with those of the subject alone,
and in the frame of the Gaussians not believed: they show that very moment."""
AGREEING = 0.65
"""The same, under which no frame's is believed."""
LOOKED_AT = 12
"""Pictures of a frame that tell what stands still, at most."""


@dataclass(frozen=True)
class Matte:
    """One picture's.

    Attributes:
        opacity: (H, W) uint8 of the subject.
        source: whence it is.
        agreement: IoU of the picture's silhouette with the Gaussians'; None where nobody was asked.
    """

    opacity: Image
    source: Source
    agreement: float | None = None


class Mattes:
    """Mattes of a scene's pictures, made when they are asked for.

    Args:
        scene: whose own mattes count.
        named: (H, W, 1) by picture, that the user has corrected; they come first.
        body: by which others are found; None while it is not known.

    Attributes:
        alone: Gaussians that were trained with the subject cut out, once they are known. They are whole where room of
            the first fit hangs before the subject; but what really stands before it does not cover them. So they are
            asked where a picture contradicts the first fit.
    """

    def __init__(
        self,
        scene: Scene,
        named: Mapping[Key, Image] | None = None,
        body: Body | None = None,
    ) -> None:
        self.scene, self.named, self.body = scene, dict(named or {}), body
        self.alone: Splats | None = None
        self._frames, self._plates, self._given = scene.open_frames(), scene.open_plates(), scene.open_mattes()
        self._drawn: tuple[Key, tuple[Array, Array]] | None = None
        self._drawn_alone: tuple[Splats, Key, tuple[Array, Array]] | None = None
        self._labelled: tuple[Splats, Bool] | None = None
        self._drawing = RLock()
        """Held by the thread that asks Gaussians: their kernels have threads of their own."""

    def known(self, key: Key) -> bool:
        """Whether it needs no Gaussians."""
        given = self._given is not None and key in self._given
        return key in self.named or given or self._plated(key)

    def each(self, keys: Iterable[Key]) -> Iterator[tuple[Key, Matte]]:
        """Of many pictures, in their order, several at a time."""

        def found(key: Key) -> tuple[Key, Matte]:
            return key, self.of(key)

        return in_order(partial(found, key) for key in keys)

    def of(self, key: Key) -> Matte:
        """Of a picture that is there."""
        if self.known(key):
            return self._plain(key, self._start)
        picture = self._frames.image(*key)
        assert self.body is not None
        with self._drawing:  # from Python 3.12 on cached properties have no lock
            camera, colours, (start, behind) = self.scene.camera_in_head(*key), self._colours, self._seen(key)
        cut = cut_out(picture, start, camera, colours)
        share = agreement(cut, start > 0.5)
        if share < ASKED and self.alone is not None:
            start = self._alone_in(key)[0]
            cut = cut_out(picture, start, camera, colours)
            share = agreement(cut, start > 0.5)
        if share < (ASKED if key[1] == self.body.frame else AGREEING):
            return Matte(_bytes(start), "gaussians", share)
        return Matte(_bytes(softened(picture, cut, start, behind, camera)), "picture", share)

    def picture(self, key: Key) -> Array:
        """(H, W, 3) in [0, 1]."""
        return _values(self._frames.image(*key))

    def cut(self, key: Key, matte: Matte) -> tuple[Array, Array]:
        """The subject cut out of a picture: its colours (H, W, 3) times opacity, and that, (H, W)."""
        photo, opacity, plate = self.picture(key), _values(matte.opacity), None
        if self._plates is not None and self._plated(key):
            plate = _values(self._plates.image(key[0], 0))
        return np.asarray(cut_from(photo, opacity, plate), np.float32), opacity

    def _plated(self, key: Key) -> bool:
        return self._plates is not None and (key[0], 0) in self._plates

    def _plain(self, key: Key, start: Callable[[Key], Expectation | None] = lambda _: None) -> Matte:
        """Of a picture for which no Gaussians are needed.

        Args:
            start: what Gaussians say of it all the same, beside a plate.
        """
        if key in self.named:
            return Matte(self.named[key][..., 0], "named")
        if self._given is not None and key in self._given:
            return Matte(self._given.image(*key)[..., 0], "capture")
        assert self._plates is not None
        found = from_plate(self._frames.image(*key), self._plates.image(key[0], 0), start=start(key))
        return Matte(_bytes(found), "plate")

    @cached_property
    def _colours(self) -> Colours | None:
        """Of the pictures of the body's frame, by the body as it was found."""
        assert self.body is not None
        body = self.body
        return colours_of(pictures(self.scene, body.splats, body.frame, body.subject))

    def _start(self, key: Key) -> Expectation | None:
        """What Gaussians say beside a plate, once they are known."""
        if self.alone is None:
            return None
        assert self._plates is not None
        opacity, colours = self._alone_in(key)
        plate = _values(self._plates.image(key[0], 0))
        return Expectation(opacity, _bytes(colours + (1 - opacity[..., None]) * plate))

    def _alone_in(self, key: Key) -> tuple[Array, Array]:
        """(H, W) opacity of the Gaussians that were trained with the subject cut out, and (H, W, 3) their colours
        times that."""
        assert self.alone is not None
        with self._drawing:
            known, same = self._drawn_alone, self._view(key)
            if known is None or known[0] is not self.alone or known[1] != same:
                there = self._in_frame(self.alone, self._alone_stands(), reference_frame(self.scene), key[1])
                seen = draw(there.values, view_of(self.scene.camera_in_head(*key))).picture()
                known = self._drawn_alone = self.alone, same, (np.asarray(1 - seen[1]), seen[0])
            return known[2]

    @cached_property
    def stands(self) -> Bool:
        """(N,) which of the body's Gaussians stand still while the head turns: the room, and perhaps shoulders."""
        assert self.body is not None
        body, poses = self.body, self.scene.poses
        if poses is None:
            return np.zeros(len(body.splats), bool)
        pairs, targets = [], []
        for frame in farthest_moved(poses, body.frame):
            still = if_still(body.splats, poses, body.frame, frame)
            pairs.append((in_frame(body.splats, ~body.subject, poses, body.frame, frame), still))
            targets.append([self._target(key, _values(self._frames.image(*key)), None) for key in self._keys(frame)])
        return ~body.subject | standing(pairs, targets, body.splats.means, body.subject)

    def begun(self) -> Splats:
        """The body's own Gaussians, in the reference frame: what stands still is elsewhere than when it was found."""
        assert self.body is not None
        body, first = self.body, reference_frame(self.scene)
        return self._in_frame(body.splats, self.stands, body.frame, first).part(body.subject)

    @property
    def anything_stands(self) -> bool:
        """Whether a part of the subject stands still while the head turns."""
        if self.body is not None:
            return bool((self.stands & self.body.subject).any())
        return bool(self._alone_stands().any())

    def _alone_stands(self) -> Bool:
        """(N,) which of the Gaussians that were trained with the subject cut out stand still while the head turns."""
        assert self.alone is not None
        if self._labelled is None or self._labelled[0] is not self.alone:
            self._labelled = self.alone, self._alone_told()
        return self._labelled[1]

    def torso(self) -> Torso | None:
        """What stays in the room while the head turns, of the Gaussians that were trained with the subject cut out."""
        assert self.alone is not None
        poses = self.scene.poses
        return (
            None if poses is None else torso_of(self.alone, self._alone_stands(), poses.at(reference_frame(self.scene)))
        )

    def _alone_told(self) -> Bool:
        """By the nearest Gaussian of the body; where there is none by cut-outs, as far as they are known without."""
        alone, poses = self.alone, self.scene.poses
        assert alone is not None
        if poses is None:
            return np.zeros(len(alone), bool)
        if self.body is not None:
            return np.asarray(self.stands[self.body.subject][cKDTree(self.begun().means).query(alone.means)[1]])
        first = reference_frame(self.scene)
        frames = farthest_moved(poses, first)
        pairs = [(alone, if_still(alone, poses, first, frame)) for frame in frames]
        known = [[key for key in self._keys(frame) if self.known(key)] for frame in frames]
        targets = [[self._target(key, *self.cut(key, self._plain(key))) for key in keys] for keys in known]
        return standing(pairs, targets, alone.means)

    def _target(self, key: Key, picture: Array, opacity: Array | None) -> TargetPicture:
        return target_of(self.scene.camera_in_head(*key), picture, opacity, 1.0)

    def _keys(self, frame: int) -> list[Key]:
        """Some pictures of a frame, of training cameras."""
        keys = [(i, frame) for i in self.scene.indices("train") if (i, frame) in self._frames]
        return spread(keys, LOOKED_AT)

    def _in_frame(self, splats: Splats, stands: Bool, first: int, frame: int) -> Splats:
        poses = self.scene.poses
        return splats if poses is None else in_frame(splats, stands, poses, first, frame)

    @cached_property
    def _stands_with(self) -> Bool:
        """(N,) which of the body's Gaussians are drawn as if they stood still: of its own those that do, of the room's
        those whose nearest does. A room without texture has Gaussians close beside the body, since nothing tells them
        from what lies far behind; a head that turns would go through them."""
        assert self.body is not None
        own, means = self.body.subject, self.body.splats.means
        return np.asarray(self.stands[own][cKDTree(means[own]).query(means)[1]])

    def _view(self, key: Key) -> Key:
        """Which pictures show the subject from the same place: all of a camera, but of a head that turns."""
        return key if self.scene.poses is not None else (key[0], 0)

    def _seen(self, key: Key) -> tuple[Array, Array]:
        """(H, W) opacity of the subject's Gaussians, and (H, W, 3) what stands behind them: of a head that turns the
        room as it stood when they were fitted."""
        assert self.body is not None
        with self._drawing:
            same = self._view(key)
            if self._drawn is None or self._drawn[0] != same:
                body, room = self.body, self.scene.camera_in_head(key[0], self.body.frame)
                there = self._in_frame(body.splats, self._stands_with, body.frame, key[1])
                seen = opacity_of(there, body.subject, self.scene.camera_in_head(*key))
                self._drawn = same, (seen, background(body.splats, body.subject, room))
            return self._drawn[1]


def _values(image: Image) -> Array:
    return np.asarray(image / np.float32(255), np.float32)


def _bytes(opacity: Array) -> Image:
    return np.rint(255 * np.clip(opacity, 0, 1)).astype(np.uint8)
