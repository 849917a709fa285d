"""What a user should look at before believing a training that ended well."""

from __future__ import annotations

from facefolds_core.captures.scene import Scene
from facefolds_core.params import WarningParams
from facefolds_core.training.explicit.fit import Fit


def warnings_of(scene: Scene, fit: Fit, params: WarningParams) -> tuple[str, ...]:
    """One line for each thing that is not well, each with what to do."""
    found = []
    if fit.volume_psnr < params.min_volume_psnr:
        found.append(
            f"warning: the starting volume explains the images with {fit.volume_psnr:.1f} dB only (under "
            f"{params.min_volume_psnr:g}): check the calibration, that nothing but the subject moves, and fit.png"
        )
    lost = fit.losses[float(fit.centre[0])]
    if lost > params.max_lost:
        found.append(
            f"warning: {lost:.0%} of the visible surface have no place in front of the centre x = {fit.centre[0]:.2f}: "
            "it will be missing or torn; add candidates to train.start.centres, or look at fit.png for what is no "
            "subject"
        )
    if any("no `front` camera" in line for line in scene.left_out):
        found.append(
            "warning: `front` was guessed from the cameras' mean direction; name a camera that faces the subject"
        )
    return tuple(found)
