"""`train` of the model `mlp`: the paper's perceptrons. The preset `paper` are its defaults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Rate, Section, Seed, Weight

Width = Annotated[int, Field(ge=1, le=65_536)]
Depth = Annotated[int, Field(ge=1, le=1000)]
Octaves = Annotated[int, Field(ge=0, le=24)]


class MlpStartParams(Section):
    """Where the manifolds start."""

    iterations: Count = 600
    """Steps of the regression onto the tracked mesh (`manifold_start: surface`)."""

    points: Annotated[int, Field(ge=8, le=10_000_000)] = 4096
    """Points in each of its steps."""

    learning_rate: Rate = 5e-3
    """Learning rate of the regression onto the tracked mesh."""

    final_learning_rate: Rate = 1e-4
    """Rate to which it falls along a cosine."""

    margin: Annotated[float, Field(gt=0, le=10)] = 0.05
    """The search ball reaches this far beyond the outermost level, units."""

    fill: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Without a tracked mesh, share of the narrower half field of view that the subject fills."""


class MlpParams(Section):
    """Model `mlp`: level sets and textures by perceptrons. Its defaults are the paper's, the preset `paper`."""

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

    start: MlpStartParams = MlpStartParams()
    """Where the manifolds start."""

    manifold_layers: Depth = 3
    """Hidden layers of the manifold predictor."""

    manifold_width: Width = 128
    """Neurons of each layer of the manifold predictor."""

    output_scale: Factor = 0.36
    """Factor on its output: how far a step moves the surfaces. Ours; a step then moves them as far as the paper's."""

    input_scale: Factor = 6.0
    """Factor on its input (x - c). Ours: larger values follow a face more closely."""

    initial_alpha_logit: Annotated[float, Field(ge=-20, le=20)] = -1.5
    """Bias of the opacity at the start, before the sigmoid. Ours: all layers are seen."""

    texture_layers: Depth = 8
    """Hidden layers of the texture predictor."""

    texture_width: Width = 256
    """Neurons of each layer of the texture predictor."""

    latent_dim: Width = 32
    """Numbers in a frame's latent."""

    uv_frequencies: Octaves = 10
    """Octaves of the positional encoding of u and v."""

    level_frequencies: Octaves = 4
    """Octaves of the encoding of the level."""

    view_frequencies: Octaves = 4
    """Octaves of the encoding of the viewing direction."""

    search_samples: Annotated[int, Field(ge=8, le=65_536)] = 256
    """Samples a ray for the first crossings, M."""

    rays: Count = 32768
    """Rays in a batch."""

    lr_manifold: Annotated[float, Field(ge=0, le=1000)] = 7e-4
    """Initial learning rate of the manifolds."""

    lr_texture: Rate = 1e-3
    """Initial learning rate of the textures."""

    decay_manifold: Annotated[float, Field(gt=0, le=1)] = 0.05
    """Factor by which the manifolds' rate falls each `decay_interval` iterations."""

    decay_texture: Annotated[float, Field(gt=0, le=1)] = 0.20
    """Factor by which the textures' rate falls each `decay_interval` iterations."""

    decay_interval: Count = 200_000
    """Iterations over which rates fall by these factors."""

    lambda_view: Weight = 1.0
    """Weight of the mean |view term|^2."""

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
