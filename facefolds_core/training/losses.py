"""The paper's loss: L = L_rec + lambda_vd L_vd + lambda_reg L_reg ("Training details")."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.training.rays import Rays


@dataclass(frozen=True)
class Losses:
    """Scalars of one batch.

    Attributes:
        total: what is minimised.
        reconstruction: mean absolute difference over rays and channels, before clamping to [0, 1].
        view: mean square of the view-dependent term over all crossings.
        regularisation: sum of the squared manifold weights but the last layer's.
        squared_error: mean square difference over rays and channels; PSNR = -10 log10 of it.
    """

    total: Tensor
    reconstruction: Tensor
    view: Tensor
    regularisation: Tensor
    squared_error: Tensor


def batch_losses(model: RadianceManifolds, rays: Rays, lambda_view: float, lambda_reg: float) -> Losses:
    """Losses of one batch, with gradients.

    "l2 penalty" of the view term is read as the mean of its square over all crossings of the batch.
    """
    traced = model.trace(rays.origins, rays.directions, rays.time, view_effects=True)
    difference = traced.rgb - rays.rgb
    reconstruction = difference.abs().mean()
    # A batch without a single crossing has no view term; the sum keeps a (zero) gradient and no 0/0.
    view = reconstruction * 0 if traced.view is None else traced.view.square().sum() / max(1, traced.view.numel())
    regularisation = model.manifolds.regularisation()
    total = reconstruction + lambda_view * view + lambda_reg * regularisation
    return Losses(total, reconstruction, view, regularisation, difference.detach().square().mean())
