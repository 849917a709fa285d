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
    """Of the regression onto the tracked mesh (`manifold_start: surface`)."""

    points: Annotated[int, Field(ge=8, le=10_000_000)] = 4096
    """Of each of its steps."""

    learning_rate: Rate = 5e-3
    """Adam's, of that regression: a shape is to be found in a few hundred steps."""

    final_learning_rate: Rate = 1e-4
    """To which it falls along a cosine."""

    margin: Annotated[float, Field(gt=0, le=10)] = 0.05
    """The search ball reaches this far beyond the outermost level's farthest point, units."""

    fill: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Without a tracked mesh: the subject is taken to fill this fraction of the narrower half field of view."""


class MlpParams(Section):
    """Model `mlp`: level sets and textures by perceptrons. Its defaults are the paper's ("Training details" and
    "Architecture Details" of FaceFolds), the preset `paper`."""

    preset: str = "paper"
    """Its values fill the keys that are not given: `paper` or `quick` for this model."""

    model: Literal["mlp"] = "mlp"
    """Follows from the preset."""

    device: Literal["auto", "cpu", "cuda"] = "auto"
    """"auto" takes CUDA where there is one."""

    seed: Seed = 0
    """Of initialisation and ray sampling."""

    layers: Annotated[int, Field(ge=1, le=64)] = 12
    """N, number of manifolds; the paper's."""

    iterations: Count = 500_000
    """Adam steps; the paper's."""

    level_halfwidth: Annotated[float, Field(gt=0, lt=0.2)] = 0.03
    """The N levels lie within this distance of the face surface, units."""

    manifold_start: Literal["sphere", "surface"] = "sphere"
    """"sphere" (the paper's), or "surface": the tracked mesh, where there is one, by a short fit before training;
    without one it is the sphere."""

    start: MlpStartParams = MlpStartParams()
    """Where the manifolds start."""

    manifold_layers: Depth = 3
    """Hidden layers of the manifold predictor; the paper's."""

    manifold_width: Width = 128
    """Neurons of each of them; the paper's."""

    output_scale: Factor = 0.36
    """Factor on its output: how far a step of Adam moves the surfaces. Ours: a step at the paper's rate then moves them
    as far as in the paper's network (docs/reference/method.md)."""

    input_scale: Factor = 6.0
    """The perceptron sees (x - c) in units of this part of the outermost radius: without it, SiLU layers of He's size
    are too smooth to follow a face. Fitted to a head for the same time, the median error was 1.2e-3 units at scale 1,
    0.8e-3 at 3 and 0.5e-3 at 6. A model keeps the scale that it was trained with in its model.json."""

    initial_alpha_logit: Annotated[float, Field(ge=-20, le=20)] = -1.5
    """Bias of the opacity: sigmoid(-1.5) = 0.18, so that all 12 layers are seen (and learn) at the start."""

    texture_layers: Depth = 8
    """Hidden layers of the texture predictor; the paper's."""

    texture_width: Width = 256
    """Neurons of each of them; the paper's."""

    latent_dim: Width = 32
    """Numbers in a frame's latent; the paper's."""

    uv_frequencies: Octaves = 10
    """Octaves of the positional encoding of u and v; the paper's."""

    level_frequencies: Octaves = 4
    """Octaves of that of the level; the paper's."""

    view_frequencies: Octaves = 4
    """Octaves of that of the viewing direction; the paper's."""

    search_samples: Annotated[int, Field(ge=8, le=65_536)] = 256
    """M, samples a ray for the first crossings; the paper's."""

    rays: Count = 32768
    """In a batch; the paper's."""

    lr_manifold: Annotated[float, Field(ge=0, le=1000)] = 7e-4
    """Initial learning rate of the manifolds; the paper's."""

    lr_texture: Rate = 1e-3
    """Initial learning rate of the textures; the paper's."""

    decay_manifold: Annotated[float, Field(gt=0, le=1)] = 0.05
    """Factor by which the manifolds' rate falls each `decay_interval` iterations, exponentially; the paper's."""

    decay_texture: Annotated[float, Field(gt=0, le=1)] = 0.20
    """The same for the textures; the paper's."""

    decay_interval: Count = 200_000
    """Iterations; the paper's."""

    lambda_view: Weight = 1.0
    """Weight of the mean |view term|^2, so that little depends on the view; the paper's."""

    lambda_reg: Weight = 1e-4
    """Weight of the sum of |manifold weights|^2, so that surfaces are smooth; the paper's."""

    checkpoint_seconds: Annotated[float, Field(gt=0, le=1e6)] = 60.0
    """A checkpoint is written this often."""


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
