"""First crossings against closed forms and against a slow, plain reference."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from facefolds_core.captures.scene import SPHERE_CENTRE
from facefolds_core.model.intersection import first_crossings, search_interval
from facefolds_core.model.manifolds import MlpManifolds

CENTRE = torch.tensor(SPHERE_CENTRE, dtype=torch.float64)
LEVELS = (0.36, 0.33, 0.30)
RADIUS = 0.45


def camera_rays(count: int, spread: float = 0.25) -> tuple[Tensor, Tensor]:
    """Rays from a unit away in front, towards points around the origin; seeded, float64."""
    generator = torch.Generator().manual_seed(3)
    beside = 0.8 * (torch.rand(count, 3, generator=generator) - 0.5).double()
    origins = torch.nn.functional.normalize(torch.tensor([1.0, 0, 0], dtype=torch.float64) + beside, dim=-1)
    targets = spread * (2 * torch.rand(count, 3, generator=generator).double() - 1)
    return origins, torch.nn.functional.normalize(targets - origins, dim=-1)


def spheres(samples: int = 64) -> MlpManifolds:
    torch.manual_seed(0)
    return MlpManifolds(SPHERE_CENTRE, LEVELS, RADIUS, hidden_layers=2, width=16, samples=samples).double()


def bumpy(samples: int = 64) -> MlpManifolds:
    """A field with a last layer that is not zero: surfaces about 0.01 away from spheres."""
    manifolds = spheres(samples=samples)
    manifolds.output_scale = 0.5
    with torch.no_grad():
        manifolds.last.weight.normal_(std=0.002)
    return manifolds


def closed_form(origins: Tensor, directions: Tensor, radius: Tensor | float) -> tuple[Tensor, Tensor]:
    """Distance to the near side of a sphere around c, and whether it is hit with n_x > 0."""
    offset = origins - CENTRE
    along = (offset * directions).sum(-1)
    discriminant = along**2 - (offset**2).sum(-1) + radius**2
    distance = -along - discriminant.clamp(min=0).sqrt()
    return distance, (discriminant > 0) & ((offset + distance[:, None] * directions)[:, 0] > 0)


def by_brute_force(field: Callable[[Tensor], Tensor], level: float, origin: Tensor, direction: Tensor) -> float | None:
    """Slow reference: 20 000 samples between 0 and 2 inside the half ball, then bisection."""
    t = torch.linspace(0, 2, 20_001, dtype=torch.float64)
    points = origin + t[:, None] * direction
    inside = ((points - CENTRE).norm(dim=-1) < RADIUS) & (points[:, 0] > CENTRE[0])
    below = field(points) < level
    for j in np.flatnonzero((inside[:-1] & inside[1:] & ~below[:-1] & below[1:]).numpy()):
        low, high = float(t[j]), float(t[j + 1])
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (low, middle) if field((origin + middle * direction)[None]) < level else (middle, high)
        return (low + high) / 2
    return None


# Worst seen in float64 3e-9: two secant steps and a Newton step.
@pytest.mark.parametrize(("dtype", "error"), [(torch.float64, 1e-7), (torch.float32, 2e-6)])
def test_concentric_spheres_in_closed_form(dtype: torch.dtype, error: float) -> None:
    origins, directions = camera_rays(500)
    found = spheres().to(dtype).crossings(origins.to(dtype), directions.to(dtype))
    for i, radius in enumerate(LEVELS):
        distance, hit = closed_form(origins, directions, radius)
        # Grazing rays whose chord is shorter than the sample spacing may be missed; none may be invented.
        assert not (found.hit[:, i] & ~hit).any()
        assert (found.hit[:, i] == hit).float().mean() > 0.99
        # Closer to tangent than this, the distance itself is ill-conditioned (a square root near 0).
        clear = found.hit[:, i] & closed_form(origins, directions, radius - 0.01)[1]
        torch.testing.assert_close(found.distance[clear, i].double(), distance[clear], atol=error, rtol=0)


def test_gradient_of_points_with_respect_to_the_radius() -> None:
    # |x - c| + b = s: the bias b of the last layer shrinks the radius to s - b; dt/db = -dt/dr in closed form.
    origins, directions = camera_rays(200, spread=0.1)
    manifolds = spheres()
    found = manifolds.crossings(origins, directions)
    assert found.hit.all()
    found.distance.sum().backward()
    radii = torch.tensor(LEVELS, dtype=torch.float64, requires_grad=True)
    sum(closed_form(origins, directions, radii[i])[0].sum() for i in range(len(LEVELS))).backward()
    assert manifolds.last.bias.grad is not None and radii.grad is not None
    torch.testing.assert_close(manifolds.last.bias.grad[0], -radii.grad.sum(), rtol=1e-6, atol=0)


def test_gradient_of_all_parameters_matches_finite_differences() -> None:
    origins, directions = camera_rays(20, spread=0.1)
    manifolds = bumpy(samples=128)
    found = manifolds.crossings(origins, directions)
    found.points[found.hit].sum().backward()
    weight = manifolds.hidden[1].weight
    for row, column in [(0, 0), (3, 5), (15, 15)]:
        values = []
        for sign in (1, -1):
            with torch.no_grad():
                weight[row, column] += sign * 1e-5
                values.append(manifolds.crossings(origins, directions).points[found.hit].sum())
                weight[row, column] -= sign * 1e-5
        assert float(weight.grad[row, column]) == pytest.approx(float(values[0] - values[1]) / 2e-5, rel=1e-4, abs=1e-8)


def test_fast_search_matches_brute_force() -> None:
    origins, directions = camera_rays(60)
    manifolds = bumpy(samples=256)
    with torch.no_grad():
        found = manifolds.crossings(origins, directions)
        for r in range(len(origins)):
            for i, level in enumerate(LEVELS):
                expected = by_brute_force(manifolds.value, level, origins[r], directions[r])
                assert bool(found.hit[r, i]) == (expected is not None)
                if expected is not None:
                    # Worst seen 3e-8, at a grazing ray.
                    assert float(found.distance[r, i]) == pytest.approx(expected, abs=1e-6)


def test_layers_stay_in_order_along_rays() -> None:
    origins, directions = camera_rays(500)
    with torch.no_grad():
        found = bumpy().crossings(origins, directions)
    outer, inner = found.hit[:, :-1], found.hit[:, 1:]
    assert not (inner & ~outer).any()
    assert (found.distance[:, 1:] > found.distance[:, :-1])[inner].all()


def test_no_surface_behind_the_centre_plane() -> None:
    # Rays that pass above the front half and would meet the spheres at n_x < 0 only.
    z = torch.linspace(0.24, 0.29, 9, dtype=torch.float64)
    targets = torch.stack([torch.full_like(z, -0.3), torch.zeros_like(z), z], -1)
    down = torch.tensor([[-1.0, 0, -1.5]], dtype=torch.float64)
    directions = torch.nn.functional.normalize(down, dim=-1).expand(9, 3)
    origins = targets - 0.8 * directions
    offset = origins - CENTRE
    along = (offset * directions).sum(-1)
    meets_sphere = along**2 - (offset**2).sum(-1) + 0.30**2 > 0
    _, in_front = closed_form(origins, directions, 0.30)
    passes_domain = search_interval(origins, directions, CENTRE, RADIUS)[2]
    assert meets_sphere.all() and passes_domain.all() and not in_front.any()
    assert not spheres().crossings(origins, directions).hit[:, 2].any()


@pytest.mark.parametrize(
    ("origin", "direction"),
    # From behind (it enters inside the surface and leaves it outwards), and from inside.
    [([-1.0, 0.02, 0.01], [1.0, 0, 0]), ([0.0, 0, 0], [-1.0, 0, 0])],
)
def test_only_a_way_in_is_a_crossing(origin: list[float], direction: list[float]) -> None:
    origins, directions = torch.tensor([origin], dtype=torch.float64), torch.tensor([direction], dtype=torch.float64)
    assert not spheres().crossings(origins, directions).hit.any()


def test_nearest_of_several_crossings_is_taken() -> None:
    class Ripples:
        """Falls through 0 at x = 0.1 and, after rising again, at x = -0.1."""

        def value(self, points: Tensor) -> Tensor:
            return (points[..., 0] - 0.1) * points[..., 0] * (points[..., 0] + 0.1)

        def value_and_slope(self, points: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
            x = points[:, 0]
            return self.value(points), (3 * x**2 - 0.01) * directions[:, 0]

    origins = torch.tensor([[1.0, 0, 0]], dtype=torch.float64)
    directions = torch.tensor([[-1.0, 0, 0]], dtype=torch.float64)
    levels = torch.zeros(1, dtype=torch.float64)
    found = first_crossings(Ripples(), levels, origins, directions, CENTRE, 0.45, 256)
    assert float(found.points[0, 0, 0]) == pytest.approx(0.1, abs=1e-6)


def test_grazing_rays_have_bounded_gradients() -> None:
    offsets = torch.linspace(0.3299, 0.33, 21, dtype=torch.float64)
    origins = torch.stack([torch.full_like(offsets, 0.5), torch.zeros_like(offsets), offsets], -1)
    directions = torch.tensor([[-1.0, 0, 0]], dtype=torch.float64).expand(len(offsets), 3).contiguous()
    manifolds = spheres(samples=2048)
    found = manifolds.crossings(origins + CENTRE * torch.tensor([0, 1, 1]), directions)
    found.distance.sum().backward()
    assert manifolds.last.bias.grad is not None
    assert abs(float(manifolds.last.bias.grad)) <= 10 * float(found.hit.sum())


def test_search_interval_lies_in_the_half_ball() -> None:
    origins, directions = camera_rays(300, spread=0.6)
    near, far, valid = search_interval(origins, directions, CENTRE, RADIUS)
    middle = origins + (0.5 * (near + far))[:, None] * directions - CENTRE
    ends = [origins + t[:, None] * directions - CENTRE for t in (near, far)]
    assert valid.any() and (~valid).any()
    assert (middle[valid].norm(dim=-1) < RADIUS).all() and (middle[valid, 0] > 0).all()
    assert all((p[valid].norm(dim=-1) < RADIUS + 1e-9).all() and (p[valid, 0] > -1e-9).all() for p in ends)
