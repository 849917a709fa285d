"""`train` of the model `mlp`: the paper's perceptrons. The preset `paper` are its defaults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Rate, Section, Seed, Weight

Width = Annotated[int, Field(ge=1, le=65_536)]
Depth = Annotated[int, Field(ge=1, le=1000)]
Octaves = Annotated[int, Field(ge=0, le=24)]


class MlpParams(Section):
    """Model `mlp`: level sets and textures by perceptrons. Its defaults are the paper's, the preset `paper`. With
    `device: auto` it takes CUDA where there is one."""

    preset: str = "paper"
    """Its values fill the keys that are not given: `paper` or `quick` for this model."""

    model: Literal["mlp"] = "mlp"
    """Follows from the preset."""

    device: Literal["auto", "cpu", "cuda"] = "auto"
    """"auto" takes CUDA where there is one."""

    seed: Seed = 0
    """Seed of initialisation and ray sampling."""

    layers: Annotated[int, Field(ge=1, le=64)] = 12
    """Number of manifolds, N."""

    iterations: Count = 500_000
    """Adam steps."""

    level_halfwidth: Annotated[float, Field(gt=0, lt=0.2)] = 0.03
    """The levels lie within this distance of the face, units."""

    manifold_start: Literal["sphere", "surface"] = "sphere"
    """ "sphere" (the paper's), or "surface": a short fit to the tracked mesh, where there is one."""

    manifold_width: Width = 128
    """Neurons of each layer of the manifold predictor."""

    output_scale: Factor = 0.36
    """Factor on its output: how far a step moves the surfaces. Ours; a step then moves them as far as the paper's."""

    texture_layers: Depth = 8
    """Hidden layers of the texture predictor."""

    texture_width: Width = 256
    """Neurons of each layer of the texture predictor."""

    uv_frequencies: Octaves = 10
    """Octaves of the positional encoding of u and v."""

    search_samples: Annotated[int, Field(ge=8, le=65_536)] = 256
    """Samples a ray for the first crossings, M."""

    rays: Count = 32768
    """Rays in a batch."""

    lr_manifold: Annotated[float, Field(ge=0, le=1000)] = 7e-4
    """Initial learning rate of the manifolds."""

    lr_texture: Rate = 1e-3
    """Initial learning rate of the textures."""

    decay_interval: Count = 200_000
    """Iterations over which rates fall to 0.05 (manifolds) and 0.2 (textures) of themselves."""

    lambda_reg: Weight = 1e-4
    """Weight of the sum of |manifold weights|^2."""

    checkpoint_seconds: Annotated[float, Field(gt=0, le=1e6)] = 60.0
    """Seconds between checkpoints."""


QUICK: dict[str, object] = {
    "layers": 6,
    "manifold_start": "surface",
    "manifold_width": 64,
    "output_scale": 1.0,
    "texture_layers": 4,
    "texture_width": 96,
    "uv_frequencies": 7,
    "search_samples": 24,
    "rays": 2048,
    "iterations": 4_000,
    "lr_manifold": 1e-4,
    "lr_texture": 4e-3,
    "lambda_reg": 1e-6,
    "decay_interval": 4_000,
}
"""Minutes on a CPU instead of days on a GPU: smaller networks, fewer and thinner batches, the mesh as a start."""
