"""What the scene tells before training: where the levels start, and (optionally) a first guess of the surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facefolds_core.captures.scene import SPHERE_CENTRE, Scene
from facefolds_core.geometry.cameras import Camera
from facefolds_core.geometry.sphere_uv import uv_to_directions
from facefolds_core.model.manifolds import MlpManifolds
from facefolds_core.params import MlpParams

Array = NDArray[np.float64]

MARGIN = 0.05
"""The search ball reaches this far beyond the outermost level, units."""

FILL = 0.8
"""Without a tracked mesh, share of the narrower half field of view that the subject fills."""

BESIDE, BEHIND = 0.05, 0.02
"""A vertex is covered if one within the first, between unit directions, lies farther out by the second, units: the
first is wider than the gaps between a tracked mesh's vertices, the second deeper than wrinkles."""

ITERATIONS = 600
"""Steps of the regression onto the tracked mesh (`manifold_start: surface`)."""

POINTS = 4096
"""Points in each of its steps."""

LEARNING_RATE, FINAL_LEARNING_RATE = 5e-3, 1e-4
"""Of that regression: the second is what the first falls to along a cosine."""


@dataclass(frozen=True)
class Outline:
    """The tracked surface as seen from c.

    Attributes:
        directions: (V, 3) unit directions from c, n_x > 0.
        radii: (V,) distance of the outermost surface in that direction.
    """

    directions: Array
    radii: Array


@dataclass(frozen=True)
class Start:
    """Where training starts.

    Attributes:
        levels: N s-values, outermost first: radii of the starting spheres.
        radius: of the search ball around c.
        outline: of the tracked mesh, or None.
    """

    levels: tuple[float, ...]
    radius: float
    outline: Outline | None


def find_start(scene: Scene, params: MlpParams) -> Start:
    """Levels within +-`level_halfwidth` of the face surface, and the ball in which crossings are searched.

    With a tracked mesh, r0 is the median distance from c of its outermost vertices in front of the scene's centre
    (x > 0: the face, not the sides of the head), and the ball encloses all outermost vertices. Without, see
    `fitted_radius`. Either way the levels are evenly spaced in r0 +- halfwidth, and the ball reaches `MARGIN`
    beyond the outermost layer if that lay halfwidth outside the surface's farthest point.
    """
    layers, halfwidth = params.layers, params.level_halfwidth
    surface = scene.load_surface()
    outline = None
    if surface is not None:
        outline = find_outline(surface[0].astype(np.float64).mean(0))
        face = SPHERE_CENTRE[0] + outline.radii * outline.directions[:, 0] > 0
        r0, farthest = float(np.median(outline.radii[face if face.any() else slice(None)])), float(outline.radii.max())
    else:
        r0, farthest = fitted_radius([scene.cameras[i] for i in scene.indices("train")], FILL)
    offsets = np.linspace(halfwidth, -halfwidth, layers) if layers > 1 else np.zeros(1)
    return Start(tuple((r0 + offsets).tolist()), farthest + halfwidth + MARGIN, outline)


def find_outline(vertices: Array) -> Outline:
    """Outermost vertices (V, 3) in front of c: none `BESIDE` lies farther out by `BEHIND`.

    This leaves out what another part of the surface covers, seen from outside: eye sockets, mouth, back of the ears.
    """
    offset = vertices - np.array(SPHERE_CENTRE)
    offset = offset[offset[:, 0] > 0]
    radii = np.linalg.norm(offset, axis=1)
    directions = offset / radii[:, None]
    neighbours = cKDTree(directions).query_ball_point(directions, BESIDE)
    highest = np.array([radii[ids].max() for ids in neighbours])
    keep = radii > highest - BEHIND
    return Outline(directions[keep], radii[keep])


def fitted_radius(cameras: list[Camera], fill: float) -> tuple[float, float]:
    """Start radius where there is no tracked mesh.

    The subject is a ball at the origin that fills `fill` of the narrower half field of view of the median camera:
    radius rho = fill median(D sin(half angle)), D the camera's distance. Over the front half of that ball cos(angle to
    +x) is uniform in [0, 1], so the median of |p - c|^2 = rho^2 + b^2 + 2 b rho cos is at cos = 1/2 (b = |c|).

    Returns:
        r0 = sqrt(rho^2 + b^2 + b rho), and b + rho, the ball's farthest point from c.
    """
    tangents = [min(0.5 * c.width / c.K[0, 0], 0.5 * c.height / c.K[1, 1]) for c in cameras]
    distances = [np.linalg.norm(c.centre) for c in cameras]
    reach = [d * math.sin(math.atan(t)) for d, t in zip(distances, tangents, strict=True)]
    rho, b = fill * float(np.median(reach)), float(np.linalg.norm(SPHERE_CENTRE))
    return math.sqrt(rho**2 + b**2 + b * rho), rho + b


def fit_outline(manifolds: MlpManifolds, outline: Outline, generator: torch.Generator) -> float:
    """Regress G(x) = |x - c| + r0 - rho(n), rho the outline's radius in direction n: the middle level on the surface.

    Three quarters of the points lie in directions of the outline's vertices; the others at random over the hemisphere
    (uniform in u, v), where rho is interpolated from the three nearest vertices, so that beyond the mesh it continues
    as its border. Points lie within 0.1 of the surface. The mean absolute error is minimised (borders and folds are
    outliers), by Adam, its learning rate falling along a cosine.

    Returns:
        the mean absolute error of the last tenth of the iterations, units.
    """
    device = manifolds.centre.device
    tree = cKDTree(outline.directions)
    nearest_count = min(3, len(outline.radii))
    middle = 0.5 * float(manifolds.levels[0] + manifolds.levels[-1])
    on_mesh = POINTS * 3 // 4
    optimiser = torch.optim.Adam(manifolds.parameters(), lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, ITERATIONS, eta_min=FINAL_LEARNING_RATE)
    errors = []
    for _ in range(ITERATIONS):
        anywhere = uv_to_directions(torch.rand(POINTS - on_mesh, 2, generator=generator) * 2 - 1).double().numpy()
        distance, nearest = (a.reshape(len(anywhere), -1) for a in tree.query(anywhere, k=nearest_count))
        weights = 1 / (distance + 1e-4)
        interpolated = (outline.radii[nearest] * weights).sum(1) / weights.sum(1)
        vertex = torch.randint(len(outline.radii), (on_mesh,), generator=generator).numpy()
        directions = np.concatenate([anywhere, outline.directions[vertex]]).astype(np.float32)
        rho = torch.from_numpy(np.concatenate([interpolated, outline.radii[vertex]]).astype(np.float32)).to(device)
        radius = rho + 0.1 * (torch.rand(POINTS, generator=generator) * 2 - 1).to(device)
        x = manifolds.centre + radius[:, None] * torch.from_numpy(directions).to(device)
        loss = (manifolds.value(x) - (radius + middle - rho)).abs().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        errors.append(float(loss.detach()))
    return float(np.mean(errors[-max(1, ITERATIONS // 10) :]))
