"""A shared reflection: what gloss adds to the layers' colours by the direction in which they are seen.

At the place (s, t) of a layer, in the direction d of the ray, with n the unit normal there,

    added = gloss(s, t) E(r) - offset(s, t),    r = d - 2 min(d . n, 0) n.

E is one small picture for all layers and frames: the light that comes from each direction, in the equal-area
projection of the sphere with the subject's front (+x) in its middle and its back (-x) on the circle around it. gloss,
offset and n are coarse maps over the window, shared by layers and frames. The offset is the mean of gloss E over the
training rays that see the place, so that the layers hold what the cameras see on average, matte.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import grid_sample, normalize

from facefolds_core.geometry.reflections import ReflectionMaps, reflected, sphere_position
from facefolds_core.geometry.sphere_uv import Window


@dataclass(frozen=True)
class ReflectionShape:
    """Sizes: rows and columns of the maps, texels a side of the environment."""

    maps: tuple[int, int]
    environment: int


class Reflection(nn.Module):
    """The maps, texel centres as in `geometry.sphere_uv`, bilinear, clamped.

    Attributes:
        gloss: [h, w], not negative.
        offset: [h, w, 3].
        normals: [h, w, 3], of any length but 0.
        environment: [e, e, 3], not negative.
    """

    def __init__(self, shape: ReflectionShape) -> None:
        super().__init__()
        h, w = shape.maps
        e = shape.environment
        self.gloss = nn.Parameter(torch.zeros(h, w))
        self.offset = nn.Parameter(torch.zeros(h, w, 3))
        self.normals = nn.Parameter(torch.ones(h, w, 3))
        self.environment = nn.Parameter(torch.zeros(e, e, 3))

    @property
    def shape(self) -> ReflectionShape:
        h, w = self.gloss.shape
        return ReflectionShape((h, w), len(self.environment))

    def maps(self, window: Window) -> ReflectionMaps:
        """As arrays."""
        gloss, offset, normals, environment = (
            part.detach().cpu().numpy().copy() for part in (self.gloss, self.offset, self.normals, self.environment)
        )
        return ReflectionMaps(window, gloss, offset, normals, environment)

    def added(self, st: Tensor, directions: Tensor, to_room: Tensor | None = None) -> Tensor:
        """[P, 3] to be added to colours at st [P, 2] over the window, seen along unit directions [P, 3]; `to_room`
        [3, 3] turns the head's axes to those of the room, which E is fixed to (None: they are the same)."""
        maps = torch.cat([self.gloss[..., None], self.offset, self.normals], -1)
        found = _sampled(maps, st)
        r = reflected(directions, normalize(found[:, 4:], dim=-1))
        light = _sampled(self.environment, sphere_position(r if to_room is None else r @ to_room.T))
        return found[:, :1] * light - found[:, 1:4]


def _sampled(image: Tensor, st: Tensor) -> Tensor:
    """[H, W, C] at st [P, 2] -> [P, C]."""
    at = (st * 2 - 1)[None, None].to(image)
    found = grid_sample(image.permute(2, 0, 1)[None], at, mode="bilinear", padding_mode="border", align_corners=False)
    return found[0, :, 0].T
