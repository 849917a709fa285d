"""How the start representation is fitted."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StartParams:
    """Of `fit_start`.

    Attributes:
        count: Gaussians at the end.
        iterations: a picture each.
    """

    count: int = 14000
    iterations: int = 2000
    seeds: float = 0.4
    """Share of the count with which it begins."""
    levels: tuple[tuple[float, float], ...] = ((0.0, 0.25), (0.15, 0.5), (0.5, 1.0))
    """From which share of the iterations on pictures of which size."""
    rate_mean: tuple[float, float] = (1e-4, 2e-6)
    """Adam's rates, units a step, first and last; farther than 1 unit from the origin in proportion to the distance."""
    rate_scale: float = 0.01
    rate_turn: float = 0.004
    rate_opacity: float = 0.05
    rate_colour: float = 0.004
    rate_shine: float = 0.0005
    every: int = 100
    """Iterations between which Gaussians are taken away and split."""
    grown: float = 0.7
    """Share of the iterations after which there are no more of them."""
    fewest: float = 0.01
    """Opacity under which a Gaussian is taken away."""
    opacity_price: float = 0.0
    dropped: float = 0.1
    ssim: float = 0.2
    ball: float = 0.25
    """Radius about the origin in which the subject is looked for, units."""
