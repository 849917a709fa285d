"""`train.reflection`: the light of the room on a glossy subject, shared by all layers and frames."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Count, Factor, Pixels, Section, Share, Weight


class ReflectionParams(Section):
    """The shared reflection: gloss(s, t) times an environment in the reflected direction."""

    enabled: bool = True
    """Try it; it is left out all the same where it does not help (`min_gain`)."""

    begin: Literal["rounds", "full", "end"] = "rounds"
    """When it is fitted first: in the first round of geometry, at full resolution, or once the textures are done, which
    then are those of a model without it. Trained with them from the start it gains most on cameras left out (`mugsy`
    1.2 dB more than at the end); for programs that cannot draw it (GLB, OpenUSD) `end` gives the better picture."""

    texels: Annotated[int, Field(ge=2, le=256)] = 96
    """Of the maps of gloss, offset and normals, along the longer side of the window."""

    environment_texels: Annotated[int, Field(ge=2, le=256)] = 16
    """A side of the environment's picture."""

    normal_blur: Pixels = 1.5
    """Smoothing of the radius map before normals are taken of it, standard deviation, nodes of the map."""

    normals: bool = True
    """Let the normals lean from those of the radius map, as the reflection asks for."""

    normal_smoothness: Weight = 0.3
    """Of how they lean, as of gloss."""

    max_tilt: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Tangent of the angle by which they lean at most, along each of two tangents."""

    gloss_smoothness: Weight = 0.1
    """Of the maps of gloss and offset: price of squared differences between neighbours, in the mean weight of a
    texel's rays."""

    environment_smoothness: Weight = 0.03
    """Of the environment, likewise."""

    fits: Annotated[int, Field(ge=1, le=100)] = 3
    """Fits in each level of training, evenly spaced, the last at its end."""

    frames: Count = 3
    """Frames whose mean is looked at, at most: gloss does not follow expressions."""

    moving_frames: Count = 8
    """Of a head that turns, frames that are looked at one by one, at most: in each the light comes from elsewhere."""

    rays: Count = 300_000
    """Looked at in a fit, at most: some hundred for each unknown."""

    rounds: Count = 4
    """Times that environment, gloss, offset and normals are solved for in turn, in a fit."""

    first_rounds: Count = 12
    """The same in the first fit, which has nothing to start from, and in those that tell whether it helps."""

    min_opacity: Share = 0.9
    """Rays that are less opaque show the room, too, and are left out of the fits."""

    max_residual: Share = 0.25
    """Larger differences between photo and model are clipped: they are hair or outline, not gloss."""

    folds: Annotated[int, Field(ge=2, le=100)] = 4
    """The cameras are left out in so many groups, in turn, to tell whether the reflection helps."""

    asked_smoothness: Factor = 10.0
    """The smoothnesses of gloss and environment times this in the fits by which it is decided: few cameras, of which
    some are left out, and textures that are still coarse do not determine finer maps (of 13 cameras of `studio` -0.3 dB
    with 1, 0.5 with 10; in the end it gains 2)."""

    smoother: Annotated[float, Field(ge=1, le=1e6)] = 10.0
    """Where it gains little (`sure_gain`) it is asked again with gloss and environment so many times as smooth, and
    fitted so if that gains more: eight of the actor's cameras do not determine finer maps, and win 0.8 dB inside."""

    sure_gain: Annotated[float, Field(ge=0, le=100)] = 0.5
    """dB on rays of cameras left out, from which on no smoother one is asked for."""

    min_gain: Annotated[float, Field(ge=0, le=100)] = 0.05
    """dB on rays of cameras left out of a fit, after the rounds of geometry; with less there is no reflection."""
