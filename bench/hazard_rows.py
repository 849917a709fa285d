"""What can be wrong with a capture or a start, each in three strengths; and what a hazard costs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.hazard_film import EXTREMES, Film, Shots, keep_cameras, keep_frames, map_cameras, map_images
from bench.results import Cell
from facefolds_core.captures.actor import ActorOptions
from facefolds_core.captures.images import Colour, corrected_colour, to_8bit
from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.files.frame_store import Image
from facefolds_core.geometry.cameras import Camera

Random = np.random.Generator
Disturb = Callable[[Shots, float, Random], Shots]
FILM = "film"
"""In place of a subject's name: the small film with a cut budget."""
WHITE_BALANCE = 0.25
"""Stops of white balance for each stop of exposure, in red and, independently, in blue."""


@dataclass(frozen=True)
class Hazard:
    """One row of the matrix.

    Attributes:
        key: for `--only` and the records.
        strengths: weak, middle, strong.
        unit: of a strength, as text with {} for the number.
        film: what the training cameras film at a strength; None: what is there anyway.
        truth: what the held-out cameras film: the same subject, cleanly.
        world: moves the whole world, held-out cameras too.
        disturb: changes the training pictures or cameras.
        scaled: model and key of `train` on which the strength is a factor; keys that are not there do not count.
    """

    key: str
    title: str
    strengths: tuple[float, float, float]
    unit: str
    film: Callable[[float], Film] | None = None
    truth: Callable[[float], Film] | None = None
    world: Disturb = lambda shots, *_: shots
    disturb: Disturb = lambda shots, *_: shots
    scaled: tuple[tuple[str, str], ...] = ()

    def label(self, strength: float) -> str:
        return self.unit.format(f"{strength:.3g}")


def fewer_cameras(shots: Shots, count: float, random: Random) -> Shots:
    """So many cameras, spread evenly over the rig from its right to its left."""
    azimuth = [math.atan2(c.centre[1], c.centre[0]) for c in shots.scene.cameras]
    order = np.argsort(azimuth)
    kept = order[np.round(np.linspace(0, len(order) - 1, int(count))).astype(int)]
    return keep_cameras(shots, sorted(kept.tolist()))


def _turned(camera: Camera, right: float, down: float) -> Camera:
    """Turned about its own centre so that what stands in the middle of the image moves by so many pixels."""
    angle = np.array([down / camera.K[1, 1], -right / camera.K[0, 0]])
    c, s = np.cos(angle), np.sin(angle)
    about_x = np.array([[1, 0, 0], [0, c[0], s[0]], [0, -s[0], c[0]]])
    about_y = np.array([[c[1], 0, -s[1]], [0, 1, 0], [s[1], 0, c[1]]])
    return replace(camera, w2c=about_x @ about_y @ camera.w2c)


def calibration_noise(shots: Shots, pixels: float, random: Random) -> Shots:
    """Every camera is believed to look elsewhere: a normal deviate of so many pixels in x and in y."""
    off = random.normal(0, pixels, (len(shots.scene.cameras), 2))
    return map_cameras(shots, lambda i, camera: _turned(camera, *off[i]))


def one_camera_off(shots: Shots, pixels: float, random: Random) -> Shots:
    """One camera is believed to look so many pixels past where it looks."""
    which, angle = int(random.integers(len(shots.scene.cameras))), random.uniform(0, 2 * math.pi)
    off = (pixels * math.cos(angle), pixels * math.sin(angle))
    return map_cameras(shots, lambda i, camera: _turned(camera, *off) if i == which else camera)


def exposure(shots: Shots, stops: float, random: Random) -> Shots:
    """Every camera has its own exposure, a normal deviate of so many stops, and white balance; clipped at 8 bits."""
    size = len(shots.scene.cameras)
    gain = np.repeat(random.normal(0, stops, (size, 1)), 3, 1)
    gain[:, [0, 2]] += random.normal(0, WHITE_BALANCE * stops, (size, 2))
    gain -= gain.mean(0)
    return map_images(shots, lambda i, image: exposed(image, 2.0 ** gain[i]))


def exposed(image: Image, gain: NDArray[np.float64]) -> Image:
    """A picture with `gain` (3,) times the light, before sRGB's curve."""
    return to_8bit(corrected_colour(image.astype(np.float32), Colour(np.diag(gain), np.zeros(3), linear=True)))


def missing_frames(shots: Shots, count: float, random: Random) -> Shots:
    """So many frames are missing in all cameras; the first one never is."""
    total = shots.scene.num_frames
    lost = random.choice(np.arange(1, total), int(count), replace=False)
    return keep_frames(shots, [k for k in range(total) if k not in lost])


def _moved_world(shots: Shots, factor: float, shift: NDArray[np.float64]) -> Shots:
    """Points x of the world move to factor x + shift; every picture stays what it is."""

    def moved(_: int, camera: Camera) -> Camera:
        centre = factor * camera.centre + shift
        return replace(camera, w2c=np.concatenate([camera.rotation, -(camera.rotation @ centre)[:, None]], 1))

    surface = shots.surface and ((factor * shots.surface[0] + shift).astype(np.float32), shots.surface[1])
    return replace(map_cameras(shots, moved), surface=surface)


def wrong_centre(shots: Shots, distance: float, random: Random) -> Shots:
    """The subject stands so far from where it should, in a random direction, units."""
    direction = random.normal(size=3)
    return _moved_world(shots, 1.0, distance * direction / np.linalg.norm(direction))


def wrong_scale(shots: Shots, factor: float, random: Random) -> Shots:
    """The whole world is so many times as large as it should be."""
    return _moved_world(shots, factor, np.zeros(3))


def wrong_radius(shots: Shots, factor: float, random: Random) -> Shots:
    """The tracked mesh is so many times as far from the sphere's centre as the face is."""
    if shots.surface is None:
        return shots
    centre = np.array(SPHERE_CENTRE, np.float32)
    return replace(shots, surface=(centre + np.float32(factor) * (shots.surface[0] - centre), shots.surface[1]))


ODD_SIZES = {n: Film(height=h, width=w) for n, h, w in ((1.0, 97, 65), (2.0, 113, 53), (3.0, 71, 89))}
"""About as many pixels as 96 x 64."""
SPACING = (("mlp", "level_halfwidth"), ("explicit", "geometry.halfwidth"))

HAZARDS: tuple[Hazard, ...] = (
    Hazard("cameras", "fewer cameras", (16, 8, 4), "{} of 22", disturb=fewer_cameras),
    Hazard("calibration", "calibration noise", (0.5, 1, 2), "{} px", disturb=calibration_noise),
    Hazard("one-off", "one camera far off", (4, 8, 16), "{} px", disturb=one_camera_off),
    Hazard("exposure", "exposure, white balance", (0.15, 0.3, 0.6), "{} stops", disturb=exposure),
    Hazard("frames", "missing frames", (1, 2, 3), "{} of 4", disturb=missing_frames),
    Hazard("blur", "motion blur", (1 / 60, 1 / 30, 1 / 15), "{} s", film=lambda s: Film(ActorOptions(shutter=s))),
    *(
        Hazard(key, title, strengths, unit, film=film, truth=film)
        for key, title, strengths, unit, film in (
            ("motion", "head motion", (0.03, 0.1, 0.3), "{} rad", lambda s: Film(ActorOptions(head_motion=s))),
            ("room", "cluttered room", (0.25, 0.5, 1), "{}", lambda s: Film(ActorOptions(clutter=s))),
            ("hair", "thin hair", (0.5, 0.2, 0.05), "x {}", lambda s: Film(ActorOptions(hair_density=s))),
            ("nose", "protruding nose", (10, 20, 40), "+{} mm", lambda s: Film(ActorOptions(nose=s))),
            ("object", "object before the face", (8, 16, 24), "{} mm", lambda s: Film(ActorOptions(ball=s))),
            ("gloss", "glossy skin", (2, 4, 8), "x {}", lambda s: Film(ActorOptions(gloss=s))),
        )
    ),
    Hazard("centre", "centre guessed wrong", (0.05, 0.1, 0.2), "{} units", world=wrong_centre),
    Hazard("radius", "radius of the mesh wrong", (0.9, 0.8, 0.6), "x {}", disturb=wrong_radius),
    Hazard("scale", "scale guessed wrong", (0.8, 1.25, 1.5), "x {}", world=wrong_scale),
    Hazard("spacing", "layer spacing", (0.5, 2, 4), "x {}", scaled=SPACING),
    Hazard("size", "odd resolutions", (1, 2, 3), "no. {}", film=lambda s: ODD_SIZES[s]),
)
CLEAN = Hazard("clean", "clean", (0, 0, 0), "-")
EXTREME = Hazard("extreme", "extreme views", (60, 75, 85), "{} degrees")
"""The clean case seen from farther aside: no training of its own."""
ROWS: tuple[Hazard, ...] = (*HAZARDS, EXTREME)


@dataclass(frozen=True)
class Loss:
    """What a hazard costs.

    Attributes:
        mean: dB lost against the clean case of the same seed, mean over seeds; None where every one failed.
        least, most: over seeds.
        seeds: that were run and have their clean case; of these `failed` ended with an error, `astray` did not
            converge.
        worst: the held-out view that lost most, mean over seeds, and its dB; "" if none.
    """

    mean: float | None
    least: float
    most: float
    seeds: int
    failed: int
    astray: int
    worst: str
    worst_loss: float


def loss_of(cells: Sequence[Cell], hazard: Hazard, strength: float) -> Loss | None:
    """Of cells of one subject and preset; None where nothing was measured."""
    clean = {c.seed: c for c in cells if c.hazard == CLEAN.key and c.psnr is not None}
    if hazard is EXTREME:
        names = [name for name, azimuth in EXTREMES.items() if abs(azimuth) == strength]
        found = [c for c in clean.values() if all(name in c.views for name in names)]
        pairs = [(c.psnr or 0.0, c.views[name], name) for c in found for name in names]
        lost = [(c.psnr or 0.0) - float(np.mean([c.views[name] for name in names])) for c in found]
    else:
        found = [c for c in cells if (c.hazard, c.strength) == (hazard.key, strength) and c.seed in clean]
        whole = [(clean[c.seed], c) for c in found if c.psnr is not None]
        pairs = [(a.views[name], value, name) for a, c in whole for name, value in c.views.items()]
        lost = [(a.psnr or 0.0) - (c.psnr or 0.0) for a, c in whole]
    if not found:
        return None
    names = list(dict.fromkeys(name for _, _, name in pairs))
    views = {name: float(np.mean([before - now for before, now, at in pairs if at == name])) for name in names}
    worst = max(views, key=lambda name: views[name]) if views else ""
    failed = len(found) - len(lost)
    astray = 0 if hazard is EXTREME else sum(not c.converged for c in found) - failed
    mean = float(np.mean(lost)) if lost else None
    span = (min(lost), max(lost)) if lost else (0.0, 0.0)
    return Loss(mean, *span, len(found), failed, astray, worst, views.get(worst, 0.0))
