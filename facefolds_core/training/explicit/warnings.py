"""What a user should look at before believing a training that ended well."""

from __future__ import annotations

from facefolds_core.captures.scene import Scene
from facefolds_core.facts import Fact, fact
from facefolds_core.params import WarningParams
from facefolds_core.training.explicit.fit import Fit


def warnings_of(scene: Scene, fit: Fit, params: WarningParams) -> tuple[Fact, ...]:
    """One for each thing that is not well; its words say what to do."""
    found = []
    if fit.start_psnr < params.min_volume_psnr:
        found.append(fact("volume_explains_little", psnr=fit.start_psnr, under=params.min_volume_psnr))
    lost = fit.losses[fit.chart]
    if lost > params.max_lost:
        found.append(fact("surface_without_a_place", share=lost, x=fit.chart.centre[0]))
    if any(
        line.kind in ("front_found", "front_guessed") or "no `front` camera" in str(line) for line in scene.left_out
    ):
        found.append(fact("front_is_guessed"))
    return tuple(found)
