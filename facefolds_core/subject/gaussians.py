"""How Gaussians are fitted to pictures."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class GaussianMethod:
    """Of `fit_pictures`: constants of the method, but for the three that the section `subject` has (`find.method_for`).

    Attributes:
        pixels: of all training pictures a Gaussian; there are `fewest` to `most` of them at the end.
        seeds: share of them with which it begins.
        ball: radius about the origin in which depths are looked for most closely, units.
        iterations: steps of Adam, a picture each.
        levels: from which share of the iterations on pictures of which size.
        rate_mean: Adam's rates of positions, units a step, first and last; farther than 1 unit from the origin in
            proportion to the distance.
        rate_scale, rate_turn, rate_opacity, rate_colour, rate_shine: of the others, see splats.py.
        every: iterations between which Gaussians are taken away and split.
        grown: share of the iterations after which there are no more of them.
        faintest: opacity under which a Gaussian is taken away.
        dropped: share of the Gaussians that is left out of each picture.
        structure: weight of SSIM beside the mean absolute difference.
        again: share of the iterations that Gaussians get which are there already: the last ones.
    """

    pixels: float = 120.0
    fewest: int = 9000
    most: int = 30000
    seeds: float = 0.4
    ball: float = 0.25
    iterations: int = 2500
    levels: tuple[tuple[float, float], ...] = ((0.0, 0.25), (0.15, 0.5), (0.5, 1.0))
    rate_mean: tuple[float, float] = (1e-4, 2e-6)
    rate_scale: float = 0.01
    rate_turn: float = 0.004
    rate_opacity: float = 0.05
    rate_colour: float = 0.004
    rate_shine: float = 0.0005
    every: int = 100
    grown: float = 0.7
    faintest: float = 0.01
    dropped: float = 0.1
    structure: float = 0.2
    again: float = 0.25
