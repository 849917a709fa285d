"""`train.reflection`: the light of the room on a glossy subject, shared by all layers and frames."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Pixels, Section, Share, Weight


class ReflectionParams(Section):
    """The shared reflection: gloss(s, t) times an environment in the reflected direction."""

    enabled: bool = True
    """Try a reflection; it is left out all the same where it does not help."""

    begin: Literal["rounds", "full", "end"] = "rounds"
    """When the reflection is first fitted: in the first round of geometry, at full resolution, or to finished textures.
    "end" is best for programs that cannot draw it (GLB, OpenUSD)."""

    texels: Annotated[int, Field(ge=2, le=256)] = 96
    """Texels of the maps of gloss, offset and normals, along the window's longer side."""

    environment_texels: Annotated[int, Field(ge=2, le=256)] = 16
    """Texels a side of the environment's picture."""

    normal_blur: Pixels = 1.5
    """Smoothing of the radius map before normals are taken of it, standard deviation, nodes."""

    normals: bool = True
    """Let the normals lean from those of the radius map."""

    normal_smoothness: Weight = 0.3
    """Weight of the smoothness of how they lean."""

    max_tilt: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Largest tangent of the angle by which they lean, along each of two tangents."""

    gloss_smoothness: Weight = 0.1
    """Weight of the smoothness of gloss and offset."""

    environment_smoothness: Weight = 0.03
    """Weight of the smoothness of the environment."""

    fits: Annotated[int, Field(ge=1, le=100)] = 3
    """Fits in each level of training, the last at its end."""

    frames: Count = 3
    """Frames whose mean is looked at, at most."""

    moving_frames: Count = 8
    """Frames of a turning head that are looked at one by one, at most."""

    rays: Count = 300_000
    """Rays looked at in a fit, at most."""

    rounds: Count = 4
    """Times that its parts are solved for in turn, in a fit."""

    first_rounds: Count = 12
    """Such times in the first fit, and in those that tell whether the reflection helps."""

    min_opacity: Share = 0.9
    """Rays that are less opaque are left out of the fits."""

    max_residual: Share = 0.25
    """Larger differences between photo and model are clipped."""

    folds: Annotated[int, Field(ge=2, le=100)] = 4
    """Groups of cameras that are left out in turn to tell whether it helps."""

    asked_smoothness: Factor = 10.0
    """Factor on the smoothness in the fits that tell whether it helps, which have fewer cameras."""

    smoother: Annotated[float, Field(ge=1, le=1e6)] = 10.0
    """Factor on the smoothness with which it is asked again where it gains little."""

    sure_gain: Annotated[float, Field(ge=0, le=100)] = 0.5
    """Gain on cameras left out, dB, from which on no smoother one is asked for."""

    min_gain: Annotated[float, Field(ge=0, le=100)] = 0.05
    """Least gain on cameras left out, dB; with less there is no reflection."""
