"""First crossings of rays with the level sets of a field, differentiable in the field's parameters.

The search (no gradient) evaluates the field at M uniform samples of the stretch where surfaces may be, takes for each
level the first pair of neighbours between which the field falls through it (outside to inside), and refines the
bracket. The crossing found, x0, is then tied to the field by one Newton step whose slope carries no gradient
(Niemeyer et al. 2020, eq. 10 to 12): x = x0 - d (G(x0) - s_i) / (grad G(x0) . d).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

MIN_SLOPE = 0.1
"""|grad G . d| is bounded below by this in the Newton step: |grad G| is about 1, so gradients at grazing angles (beyond
84 degrees) are at most 10 times those seen head on."""

REFINEMENTS = 1
"""Safeguarded secant steps on each bracket. With the chord before and the Newton step after it, the error on a field
fitted to a head was 1e-12 in the median and 5e-6 at the 99th percentile (24 samples a ray)."""


class Field(Protocol):
    """A scalar field G that is positive-outward: it falls along a ray that enters a surface."""

    def value(self, points: Tensor) -> Tensor:
        """[..., 3] -> [...]."""
        ...

    def value_and_slope(self, points: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """[P, 3], [P, 3] -> G [P] (with gradient) and grad G . d [P] (without)."""
        ...


@dataclass(frozen=True)
class Crossings:
    """Nearest crossing of R rays with N layers, outermost first.

    Attributes:
        points: [R, N, 3]; where a layer is missed, anything finite.
        distance: [R, N] along the ray; 0 where missed.
        hit: [R, N] bool.
    """

    points: Tensor
    distance: Tensor
    hit: Tensor


def search_interval(
    origins: Tensor, directions: Tensor, centre: Tensor, radius: float, front: bool = True
) -> tuple[Tensor, Tensor, Tensor]:
    """The stretch of each ray inside the half ball |x - c| < radius, x > c_x, ahead of its origin.

    The half ball is convex, so the stretch is one interval: a ray cannot leave the domain of the UV map (n_x > 0) and
    come back, and nothing outside the domain is ever looked up.

    Args:
        origins, directions: [R, 3], directions of unit length.
        centre: [3].
        front: the half with x > c_x alone; False for the whole ball.

    Returns:
        near [R], far [R] and valid [R] bool; near = far = 0 where the ray misses the half ball.
    """
    offset = origins - centre
    along = (offset * directions).sum(-1)
    discriminant = along**2 - ((offset**2).sum(-1) - radius**2)
    half_chord = discriminant.clamp(min=0).sqrt()
    near, far = -along - half_chord, -along + half_chord
    if not front:
        near = near.clamp(min=0)
        valid = (discriminant > 0) & (far > near)
        return torch.where(valid, near, 0.0), torch.where(valid, far, 0.0), valid
    x, dx = offset[:, 0], directions[:, 0]
    plane = -x / torch.where(dx == 0, torch.ones_like(dx), dx)
    near = torch.where(dx > 0, torch.maximum(near, plane), near).clamp(min=0)
    far = torch.where(dx < 0, torch.minimum(far, plane), far)
    valid = (discriminant > 0) & (far > near) & ((dx != 0) | (x > 0))
    return torch.where(valid, near, 0.0), torch.where(valid, far, 0.0), valid


Brackets = tuple[Tensor, Tensor, tuple[Tensor, Tensor, Tensor, Tensor]]
"""P pairs of neighbouring samples between which the field falls through a level, in order of (ray, layer): [P] indices
of ray and layer; then distances along the ray, near and far, and field minus level there, >= 0 and < 0."""


@torch.no_grad()
def bracket_crossings(
    field: Field, levels: Tensor, origins: Tensor, directions: Tensor, centre: Tensor, radius: float, samples: int
) -> Brackets:
    """For each ray and level the first of `samples` uniform samples at which the field has fallen below the level.

    Args:
        levels: [N].
        origins, directions: [R, 3].
    """
    near, far, valid = search_interval(origins, directions, centre, radius)
    rays = valid.nonzero().squeeze(1)
    near, far = near[rays], far[rays]
    fraction = torch.linspace(0, 1, samples, dtype=near.dtype, device=near.device)
    distance = near[:, None] + (far - near)[:, None] * fraction
    points = origins[rays, None] + distance[..., None] * directions[rays, None]
    values = field.value(points)
    below = values[..., None] < levels
    # Outside to inside: below at this sample, not below at the one before. Starting inside is not a crossing.
    falls = below[:, 1:] & ~below[:, :-1]
    found, first = falls.max(dim=1)
    ray, layer = found.nonzero(as_tuple=True)
    j = first[ray, layer]
    level = levels[layer]
    ends = distance[ray, j], distance[ray, j + 1], values[ray, j] - level, values[ray, j + 1] - level
    return rays[ray], layer, ends


def refine(field: Field, brackets: Brackets, levels: Tensor, origins: Tensor, directions: Tensor) -> Tensor:
    """Distances [P] of the crossings inside `brackets`, with the gradient of the field's parameters."""
    ray, layer, (nearest, farthest, value_near, value_far) = brackets
    o, d, level = origins[ray], directions[ray], levels[layer]
    with torch.no_grad():
        near, far = nearest, farthest
        distance = _secant(near, far, value_near, value_far)
        for _ in range(REFINEMENTS):
            value = field.value(o + distance[:, None] * d) - level
            inside = value < 0
            near, value_near = torch.where(inside, near, distance), torch.where(inside, value_near, value)
            far, value_far = torch.where(inside, distance, far), torch.where(inside, value, value_far)
            distance = _secant(near, far, value_near, value_far)
    value, slope = field.value_and_slope(o + distance[:, None] * d, d)
    # The field falls along the ray at an entry, so the slope is negative; it is bounded away from 0.
    step = (value - level) / slope.clamp(max=-MIN_SLOPE)
    return (distance - step).clamp(min=nearest, max=farthest)


def _secant(near: Tensor, far: Tensor, value_near: Tensor, value_far: Tensor) -> Tensor:
    """Where the chord through the bracket's ends vanishes; value_near >= 0 > value_far."""
    return near + (far - near) * (value_near / (value_near - value_far))


def first_crossings(
    field: Field,
    levels: Tensor,
    origins: Tensor,
    directions: Tensor,
    centre: Tensor,
    radius: float,
    samples: int,
) -> Crossings:
    """Nearest outside-to-inside crossing of each ray with each level set, inside the half ball around `centre`.

    Args:
        field: G.
        levels: [N], falling (outermost first).
        origins, directions: [R, 3], directions of unit length.
        centre: [3], c.
        radius: of the ball, which must enclose all level sets.
        samples: M.
    """
    shape = (len(origins), len(levels))
    brackets = bracket_crossings(field, levels, origins, directions, centre, radius, samples)
    found = refine(field, brackets, levels, origins, directions)
    hit = torch.zeros(shape, dtype=torch.bool, device=origins.device)
    hit[brackets[:2]] = True
    distance = torch.zeros(shape, dtype=found.dtype, device=origins.device)
    distance = distance.index_put(brackets[:2], found)
    points = origins[:, None] + distance[..., None] * directions[:, None]
    return Crossings(points, distance, hit)
