"""`train.reflection`: the light of the room on a glossy subject, shared by all layers and frames."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from facefolds_core.params.base import Section


class ReflectionParams(Section):
    """The shared reflection: gloss(s, t) times an environment in the reflected direction."""

    enabled: bool = True
    """Try a reflection; it is left out all the same where it does not help."""

    begin: Literal["rounds", "end"] = "rounds"
    """When the reflection is first fitted: in the first round of geometry, or to finished textures. "end" is best for
    programs that cannot draw it (GLB, OpenUSD)."""

    texels: Annotated[int, Field(ge=2, le=256)] = 96
    """Texels of the maps of gloss, offset and normals, along the window's longer side."""

    environment_texels: Annotated[int, Field(ge=2, le=256)] = 16
    """Texels a side of the environment's picture."""

    fits: Annotated[int, Field(ge=1, le=100)] = 3
    """Fits in each level of training, the last at its end."""
