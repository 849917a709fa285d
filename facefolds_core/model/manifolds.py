"""Where the layers are: N nested surfaces, level sets of one scalar field."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import silu

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.similarity import Similarity
from facefolds_core.geometry.sphere_uv import FULL_WINDOW, uv_to_directions
from facefolds_core.model.intersection import Crossings, first_crossings
from facefolds_core.model.layers import LinearStack

CHUNK = {"cpu": 1 << 15, "cuda": 1 << 21}
"""Points that the field is evaluated at together without gradient: on a CPU the activations then stay in its cache."""


class MlpManifolds(nn.Module):
    """The paper's manifold predictor: layer i is {x : G(x) = s_i}, G a multilayer perceptron.

    G(x) = |x - c| + k MLP(6 (x - c) / levels[0]), the last layer of the MLP zero to start with. The start is an exact
    sphere around c with |grad G| = 1, and the s-values are radii in scene units. (The paper starts from the
    initialisation of Atzmon & Lipman 2020, which is a sphere only in the limit of infinite width.) Activation: SiLU, so
    that surfaces are smooth; the paper names none.

    Args:
        centre: c.
        levels: N values s_i, falling: outermost first.
        radius: of the ball that encloses all layers: crossings are searched in its front half only.
        hidden_layers, width: of the MLP.
        samples: M, samples a ray for the search.
        input_scale: the MLP sees input_scale (x - c) / levels[0].
        output_scale: k. With a last layer of zeros it sets how far a step of Adam moves the surfaces.
    """

    centre: Tensor
    levels: Tensor

    def __init__(
        self,
        centre: tuple[float, ...],
        levels: tuple[float, ...],
        radius: float,
        hidden_layers: int,
        width: int,
        samples: int,
        input_scale: float = 6.0,
        output_scale: float = 1.0,
    ) -> None:
        super().__init__()
        x, y, z = centre
        self.chart, self.window, self.torso = Chart((x, y, z)), FULL_WINDOW, None
        self.register_buffer("centre", torch.tensor(centre, dtype=torch.float32))
        self.register_buffer("levels", torch.tensor(levels, dtype=torch.float32))
        self.radius = radius
        self.scale = input_scale / levels[0]
        self.output_scale = output_scale
        self.samples = samples
        self.hidden = LinearStack([3] + [width] * hidden_layers)
        self.last = nn.Linear(width, 1)
        with torch.no_grad():
            for layer in self.hidden:
                # He's variance: it keeps the activations' size through SiLU. Biases spread the first layer's kinks.
                nn.init.normal_(layer.weight, std=math.sqrt(2.0 / layer.in_features))
                nn.init.uniform_(layer.bias, -1, 1) if layer.in_features == 3 else nn.init.zeros_(layer.bias)
            nn.init.zeros_(self.last.weight)
            nn.init.zeros_(self.last.bias)

    @property
    def num_layers(self) -> int:
        return len(self.levels)

    def crossings(self, origins: Tensor, directions: Tensor, pose: Similarity | None = None) -> Crossings:
        """Rays [R, 3] -> nearest crossing with each layer, outermost first; differentiable. A pose moves no layer."""
        return first_crossings(self, self.levels, origins, directions, self.centre, self.radius, self.samples)

    def radii_at(self, uv: Tensor) -> tuple[Tensor, Tensor]:
        """Directions (u, v) [M, 2] -> radius of each layer [M, N], and whether it has a point there [M, N].

        By rays from the enclosing ball towards c.
        """
        outward = uv_to_directions(uv)
        crossings = self.crossings(self.centre + self.radius * outward, -outward)
        return self.radius - crossings.distance, crossings.hit

    def regularisation(self) -> Tensor:
        """Sum of the squared weights (biases left out) of all layers but the last (paper, "Training details")."""
        return torch.stack([layer.weight.square().sum() for layer in self.hidden]).sum()

    def value(self, points: Tensor) -> Tensor:
        """G at points [..., 3] -> [...]. Without gradient it works in chunks, in bounded memory."""
        flat = points.reshape(-1, 3)
        if torch.is_grad_enabled():
            values = self._evaluate(flat)
        else:
            values = torch.cat([self._evaluate(chunk) for chunk in flat.split(CHUNK[points.device.type])])
        return values.view(points.shape[:-1])

    def _evaluate(self, points: Tensor) -> Tensor:
        offset = points - self.centre
        h = offset * self.scale
        for layer in self.hidden:
            h = silu(layer(h), inplace=not torch.is_grad_enabled())
        values: Tensor = offset.norm(dim=-1) + self.output_scale * self.last(h).squeeze(-1)
        return values

    def value_and_slope(self, points: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """G [P] and grad G . d [P] in one pass; the slope carries no gradient (it is the Newton step's denominator)."""
        offset = points - self.centre
        distance = offset.norm(dim=-1)
        h, dh = offset * self.scale, directions * self.scale
        for layer in self.hidden:
            z = layer(h)
            h = silu(z)
            with torch.no_grad():
                s = torch.sigmoid(z)
                dh = (dh @ layer.weight.T) * (s + h * (1 - s))  # silu'(z) = s + z s (1 - s), h = z s
        with torch.no_grad():
            bent = self.output_scale * (dh @ self.last.weight.T).squeeze(-1)
            slope = (offset * directions).sum(-1) / distance.clamp(min=1e-9) + bent
        return distance + self.output_scale * self.last(h).squeeze(-1), slope
