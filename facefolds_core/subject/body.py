"""Which Gaussians of a whole scene are the subject, as the pictures agree on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from facefolds_core.captures.scene import Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.subject.cut_out import Array, Bool, Image, colours_of, cut_out, doubted, grown, pixels
from facefolds_core.subject.found import background, belief, connected, near_enough, opacity_of, subject_of
from facefolds_core.subject.splats import Splats
from facefolds_core.subject.storage import Body

ROUNDS = 2
"""How often pictures and Gaussians tell each other."""
GROW = 4.0
"""Silhouettes that vote are larger by so many pixels, at a picture of 384, so that what GrabCut takes away once is not
lost."""
SHARE = 0.6
"""Of the pictures that see a Gaussian and take it for the subject's, at least."""


def body_among(scene: Scene, splats: Splats, frame: int) -> Body:
    """The body at the centre, as the training pictures of a frame agree on it: what the Gaussians say of each picture
    is said to the pixel by its colours, and these silhouettes vote on the Gaussians. Where a picture looks as it would
    without them, they are not believed: before a plain wall some hang in the air, of its colour. What hangs behind the
    subject is hidden by it from most cameras, which cannot vote against it: what stays must be connected."""
    body, possible = Body(splats, subject_of(splats, scene), frame), near_enough(splats, scene)
    believed = belief(splats, scene, body.subject)
    for _ in range(ROUNDS):
        marks = np.where(believed > 0, believed, 1) * body.subject
        seen = [
            (picture, doubted(picture, start, background(splats, body.subject, camera), camera), camera)
            for picture, start, camera in pictures(scene, splats, frame, marks)
        ]
        colours, larger = colours_of(seen), []
        for picture, start, camera in seen:
            cut = cut_out(picture, start, camera, colours)
            larger.append((camera, grown(cut.astype(np.uint8), pixels(GROW, camera)) > 0))
        body = Body(splats, connected(splats, possible & _voted(splats, larger), scene), frame)
    return body


def pictures(scene: Scene, splats: Splats, frame: int, subject: Bool | Array) -> Iterator[tuple[Image, Array, Camera]]:
    """Training pictures of a frame, the subject's opacity in them, and their cameras."""
    store = scene.open_frames()
    for i in scene.indices("train"):
        if (i, frame) in store:
            camera = scene.camera_in_head(i, frame)
            yield store.image(i, frame), opacity_of(splats, subject, camera), camera


def _voted(splats: Splats, cuts: list[tuple[Camera, Bool]]) -> Bool:
    """(N,) Gaussians that at least `SHARE` of the silhouettes (H, W) has in whose pictures they lie."""
    seen, inside = np.zeros(len(splats)), np.zeros(len(splats))
    for camera, cut in cuts:
        places, depth = camera.project(splats.means.astype(np.float64))
        there = (places >= 0).all(1) & (places[:, 0] < camera.width) & (places[:, 1] < camera.height) & (depth > 0)
        x, y = places[there].astype(np.int64).T
        seen += there
        inside[there] += cut[y, x]
    return np.asarray((seen > 0) & (inside >= SHARE * seen))
