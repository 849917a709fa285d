"""Rays, hair, light: the actor's own renderer. It shares nothing with the product's rendering but the `Camera`.

Every pixel is first sampled at its centre; where the sample differs from a neighbour's in colour or opacity, the
pixel becomes the mean of that sample and three more around it. Nothing is random: a picture depends on its arguments
only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import prange
from numpy.typing import NDArray

from facefolds_core.captures.actor.hair import march
from facefolds_core.captures.actor.hair import reach as hair_reach
from facefolds_core.captures.actor.motion import BALL, NOSE, head_pose, pose_at
from facefolds_core.captures.actor.noise import Vector, span
from facefolds_core.captures.actor.room import room_colour
from facefolds_core.captures.actor.shade import surface_colour
from facefolds_core.captures.actor.shape import AROUND, RADIUS, normal, surface, trace
from facefolds_core.captures.actor.shape import reach as shape_reach
from facefolds_core.geometry.cameras import Array, Camera
from facefolds_core.kernels.jit import compiled, kernel

_DIFFERENT = 0.1
"""Neighbours that differ by more than this in a colour or in opacity are sampled more finely."""
EXPOSURES = 5
"""Sharp pictures in one that is exposed for a while."""
_TILE = 4
"""Pixels: the rays of so large a square start together, where the first of them may meet something."""

# Unit direction to the light (head standing still: x to its left, y up, z forward) and colour. The key light comes from
# above, in front of the left cheek; then a fill from the window's side and two rims from behind.
_LIGHTS = np.array(
    [
        [0.48, 0.52, 0.71, 0.62, 0.58, 0.52],
        [-0.72, 0.10, 0.69, 0.20, 0.23, 0.27],
        [-0.80, 0.45, -0.40, 0.20, 0.22, 0.25],
        [0.85, 0.30, -0.43, 0.18, 0.15, 0.12],
    ]
)
_LIGHTS[:, :3] /= np.linalg.norm(_LIGHTS[:, :3], axis=1, keepdims=True)


@dataclass(frozen=True)
class ActorOptions:
    """Ways to make the actor easier or harder.

    Attributes:
        gloss: factor on all gloss; 0 makes the head view-independent.
        hair_density: factor on the hair's extinction; 0 makes it bald.
        head_motion: amplitude of a rigid turn and nod, radians; 0 keeps the skull still.
        clutter: 0 the room as painted, 1 tiles of random colours all over it.
        nose: mm by which the nose is longer.
        ball: radius of a striped ball before the mouth, mm; it is part of the subject. 0 is none.
        shutter: seconds that a picture is exposed, half before and half after its time.
        away: kilometres that the head is lifted out of the picture; 1 leaves the room alone, a clean plate.
    """

    gloss: float = 1.0
    hair_density: float = 1.0
    head_motion: float = 0.0
    clutter: float = 0.0
    nose: float = 0.0
    ball: float = 0.0
    shutter: float = 0.0
    away: float = 0.0


_UP = np.array([0.0, -1e6, 0.0])
"""A kilometre above, mm: no camera looks there."""


@dataclass(frozen=True)
class ActorPicture:
    """What a camera sees.

    Attributes:
        rgb: (H, W, 3) uint8, display-referred.
        opacity: (H, W) float32 in [0, 1]: subject (hair included) against the room.
        depth: (H, W) float32: distance in mm along the optical axis of the first opaque surface of the subject, at the
            pixel's centre; inf where there is none. Hair is not opaque and has no depth.
    """

    rgb: NDArray[np.uint8]
    opacity: NDArray[np.float32]
    depth: NDArray[np.float32]


@compiled
def _ray(u: float, v: float, to_world: Array, centre: Array, frame: Array) -> tuple[Vector, Vector, Vector, float]:
    """The ray through continuous image coordinates (u, v): direction in the world; origin, direction in the head; mm
    along the ray a mm along the optical axis.
    """
    wx = to_world[0, 0] * u + to_world[0, 1] * v + to_world[0, 2]
    wy = to_world[1, 0] * u + to_world[1, 1] * v + to_world[1, 2]
    wz = to_world[2, 0] * u + to_world[2, 1] * v + to_world[2, 2]
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    w = (wx / length, wy / length, wz / length)
    # Into the head's frame: X = R^T (X_w - t).
    a = (centre[0] - frame[0, 3], centre[1] - frame[1, 3], centre[2] - frame[2, 3])
    return w, _turned(frame, a), _turned(frame, w), length


@compiled
def _turned(frame: Array, a: Vector) -> Vector:
    """R^T a."""
    return (
        frame[0, 0] * a[0] + frame[1, 0] * a[1] + frame[2, 0] * a[2],
        frame[0, 1] * a[0] + frame[1, 1] * a[1] + frame[2, 1] * a[2],
        frame[0, 2] * a[0] + frame[1, 2] * a[1] + frame[2, 2] * a[2],
    )


@compiled
def _starts(i: int, j: int, to_world: Array, centre: Array, frame: Array, pose: Array) -> tuple[float, float]:
    """For a tile of pixels: how far along its rays there is no surface, and how far no hair."""
    u, v = (j + 0.5) * _TILE, (i + 0.5) * _TILE
    _, o, d, _ = _ray(u, v, to_world, centre, frame)
    spread = 0.0
    for a in range(2):
        for b in range(2):
            # Samples lie up to 0.38 beyond a pixel's centre, so within the tile.
            _, _, e, _ = _ray(u + (a - 0.5) * _TILE, v + (b - 0.5) * _TILE, to_world, centre, frame)
            cosine = d[0] * e[0] + d[1] * e[1] + d[2] * e[2]
            spread = max(spread, math.sqrt(max(1.0 - cosine * cosine, 0.0)))
    return shape_reach(o, d, 1.02 * spread, pose), hair_reach(o, d, 1.02 * spread)


@compiled
def _sample(
    u: float,
    v: float,
    starts: tuple[float, float],
    to_world: Array,
    centre: Array,
    frame: Array,
    pose: Array,
    lights: Array,
    settings: Array,
) -> tuple[float, float, float, float, float]:
    """One ray through continuous image coordinates (u, v): colour, opacity, depth of the surface (inf for none).

    Args:
        starts: distances along the ray before which there is no surface, and no hair.
    """
    w, o, d, length = _ray(u, v, to_world, centre, frame)
    gloss, amount, clutter = settings[0], settings[1], settings[2]
    hit = math.inf
    if starts[0] < math.inf:
        _, far = span(o, d, AROUND, RADIUS, 0.0)
        hit = trace(o, d, starts[0], far, pose)
    red, green, blue, through = 0.0, 0.0, 0.0, 1.0
    if starts[1] < hit:
        red, green, blue, through = march(o, d, starts[1], hit, lights, amount, gloss)
    if through <= 0.0:
        return red, green, blue, 1.0, hit / length
    if hit < math.inf:
        p = (o[0] + hit * d[0], o[1] + hit * d[1], o[2] + hit * d[2])
        _, material = surface(p[0], p[1], p[2], pose)
        n = normal(p[0], p[1], p[2], pose)
        r, g, bl = surface_colour(p, n, (-d[0], -d[1], -d[2]), material, pose, lights, gloss)
        return red + through * r, green + through * g, blue + through * bl, 1.0, hit / length
    r, g, bl = room_colour((centre[0], centre[1], centre[2]), w, clutter)
    return red + through * r, green + through * g, blue + through * bl, 1.0 - through, math.inf


@compiled
def _differs(image: Array, i: int, j: int) -> bool:
    """Whether pixel (row i, column j) of (H, W, 5) samples differs from one of its eight neighbours."""
    height, width = image.shape[0], image.shape[1]
    for a in range(max(i - 1, 0), min(i + 2, height)):
        for b in range(max(j - 1, 0), min(j + 2, width)):
            for c in range(4):
                if abs(image[a, b, c] - image[i, j, c]) > _DIFFERENT:
                    return True
    return False


@kernel(parallel=True)
def _render_samples(
    height: int,
    width: int,
    to_world: Array,
    centre: Array,
    frame: Array,
    pose: Array,
    lights: Array,
    settings: Array,
) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.float32]]:
    """Anti-aliased rgb (H, W, 3) and opacity (H, W), and depth (H, W) at pixel centres."""
    starts = np.empty(((height - 1) // _TILE + 1, (width - 1) // _TILE + 1, 2))
    for i in prange(starts.shape[0]):
        for j in range(starts.shape[1]):
            starts[i, j] = _starts(i, j, to_world, centre, frame, pose)
    first = np.empty((height, width, 5))
    for i in prange(height):
        for j in range(width):
            start = (starts[i // _TILE, j // _TILE, 0], starts[i // _TILE, j // _TILE, 1])
            r, g, b, a, t = _sample(j + 0.5, i + 0.5, start, to_world, centre, frame, pose, lights, settings)
            first[i, j, 0], first[i, j, 1], first[i, j, 2] = min(r, 1.0), min(g, 1.0), min(b, 1.0)
            first[i, j, 3], first[i, j, 4] = a, t
    rgb = np.empty((height, width, 3), np.uint8)
    opacity, depth = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    for i in prange(height):
        smooth = np.empty(4)
        for j in range(width):
            smooth[:] = first[i, j, :4]
            if _differs(first, i, j):
                start = (starts[i // _TILE, j // _TILE, 0], starts[i // _TILE, j // _TILE, 1])
                for k in range(3):
                    # A triangle about the centre, turned so that no two samples share a row or a column.
                    angle = 2.0 * math.pi * (k / 3.0 + 0.04)
                    u, v = j + 0.5 + 0.38 * math.cos(angle), i + 0.5 + 0.38 * math.sin(angle)
                    r, g, b, a, _ = _sample(u, v, start, to_world, centre, frame, pose, lights, settings)
                    smooth[0] += min(r, 1.0)
                    smooth[1] += min(g, 1.0)
                    smooth[2] += min(b, 1.0)
                    smooth[3] += a
                smooth *= 0.25
            for c in range(3):
                rgb[i, j, c] = int(np.rint(255.0 * smooth[c]))
            opacity[i, j], depth[i, j] = smooth[3], first[i, j, 4]
    return rgb, opacity, depth


def render(camera: Camera, time: float, options: ActorOptions | None = None) -> ActorPicture:
    """The actor as a camera sees it.

    Args:
        camera: in the capture's world (mm, head near z = 1000), continuous image coordinates.
        time: seconds; any, also between frames; periodic in `motion.PERIOD`.
        options: see `ActorOptions`.
    """
    options = options or ActorOptions()
    if options.shutter > 0:
        return _exposed(camera, time, options)
    rotation, translation = head_pose(time, options.head_motion)
    frame = np.concatenate([rotation, (translation + options.away * _UP)[:, None]], 1)
    pose = pose_at(time)
    pose[NOSE], pose[BALL] = options.nose, options.ball
    # The lights stand in the room: turn them into the head's frame.
    lights = _LIGHTS.copy()
    lights[:, :3] = _LIGHTS[:, :3] @ np.diag([1.0, -1.0, -1.0]) @ rotation
    to_world = np.ascontiguousarray(camera.rotation.T @ np.linalg.inv(camera.K))
    settings = np.array([options.gloss, options.hair_density, options.clutter])
    rgb, opacity, depth = _render_samples(
        camera.height,
        camera.width,
        to_world,
        np.ascontiguousarray(camera.centre),
        frame,
        pose,
        lights,
        settings,
    )
    return ActorPicture(rgb, opacity, depth)


def _exposed(camera: Camera, time: float, options: ActorOptions) -> ActorPicture:
    """The mean of EXPOSURES sharp pictures, evenly spread over the time that the shutter is open; depth at `time`."""
    sharp = replace(options, shutter=0.0)
    times = time + options.shutter * (np.arange(EXPOSURES) / (EXPOSURES - 1) - 0.5)
    pictures = [render(camera, float(t), sharp) for t in times]
    return ActorPicture(
        rgb=np.rint(np.mean([p.rgb for p in pictures], 0)).astype(np.uint8),
        opacity=np.mean([p.opacity for p in pictures], 0).astype(np.float32),
        depth=pictures[EXPOSURES // 2].depth,
    )
