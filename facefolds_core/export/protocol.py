"""What export asks of a model. `facefolds_core.model.RadianceManifolds` is one; tests use closed-form layers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from facefolds_core.geometry.chart import Chart
from facefolds_core.geometry.reflections import ReflectionMaps
from facefolds_core.geometry.sphere_uv import Window

if TYPE_CHECKING:
    from torch import Tensor


class CrossingsLike(Protocol):
    """First crossings of R rays with N layers, outermost first."""

    @property
    def points(self) -> Tensor:
        """[R, N, 3]."""
        ...

    @property
    def hit(self) -> Tensor:
        """[R, N] bool."""
        ...


class RenderedLike(Protocol):
    """R composited rays."""

    @property
    def weights(self) -> Tensor:
        """[R, N] compositing weights, outermost first."""
        ...


class TexelGridLike(Protocol):
    """Texels of an image of `shape` (H, W) over `window`."""

    @property
    def window(self) -> Window: ...

    @property
    def shape(self) -> tuple[int, int]: ...


class LayeredModel(Protocol):
    """N nested surfaces with textures in time, outermost first. See `RadianceManifolds` for each method."""

    @property
    def num_layers(self) -> int: ...

    @property
    def num_frames(self) -> int: ...

    @property
    def centre(self) -> Tensor:
        """[3], c."""
        ...

    @property
    def chart(self) -> Chart:
        """Where (u, v) and radii lie."""
        ...

    @property
    def window(self) -> Window:
        """(u0, u1, v0, v1) beyond which there are no surfaces."""
        ...

    def crossings(self, origins: Tensor, directions: Tensor) -> CrossingsLike: ...

    def render(self, origins: Tensor, directions: Tensor, time: float, view_effects: bool) -> RenderedLike: ...

    def reflection_maps(self) -> ReflectionMaps | None:
        """What it adds by the direction, the same for all layers and frames; None for nothing."""
        ...

    def texel_grid(self) -> TexelGridLike | None:
        """The texels between which its textures are bilinear; None where there are none."""
        ...

    def surface_points(self, uv: Tensor) -> tuple[Tensor, Tensor]:
        """[M, 2] -> points [N, M, 3], valid [N, M]."""
        ...

    def texture(self, uv: Tensor, layer: int, time: float) -> tuple[Tensor, Tensor]:
        """[M, 2] -> rgb [M, 3], alpha [M], in [0, 1]."""
        ...
