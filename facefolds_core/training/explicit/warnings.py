"""What a user should look at before believing a training that ended well."""

from __future__ import annotations

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.training.explicit.fit import Fit

MIN_START_PSNR = 25.0
"""Least PSNR of the subject's Gaussians over the training pictures, dB."""
MAX_LOST = 0.05
"""Largest share of the visible surface without a place in the chart."""


def warnings_of(scene: Scene, fit: Fit) -> tuple[Fact, ...]:
    """One for each thing that is not well; its words say what to do."""
    found = []
    if fit.start_psnr < MIN_START_PSNR:
        found.append(fact("start_explains_little", psnr=fit.start_psnr, under=MIN_START_PSNR))
    lost = fit.losses[fit.chart]
    if lost > MAX_LOST:
        found.append(fact("surface_without_a_place", share=lost, x=fit.chart.centre[0]))
    if any(line.kind == "front_found" for line in scene.left_out):
        found.append(fact("front_is_guessed"))
    return tuple(found)
