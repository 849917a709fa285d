"""`train.pruning`: what a trained model does without."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Natural, Section, Share, Weight


class PruningParams(Section):
    """What is left out of the trained model."""

    layer_alpha: Share = 1 / 255
    """Outer or inner layers whose alpha is nowhere larger are dropped: no pixel changes by more."""

    texel_opacity: Share = 1 / 1020
    """Texels that add less to the opacity of every training ray looked at are made transparent."""

    room_gain: Weight = 0.001
    """Directions in which the layers show the pictures better than the bare background by less than this, in mean
    squared error, are made transparent. 0: none."""

    beside_layers_gain: Weight = 0.0003
    """As `room_gain`, against the room seen beside the layers and continued behind them. 0: none."""

    beside_layers_opacity: Share = 0.05
    """Pixels on which the layers are less opaque show what is beside them."""

    room_frames: Count = 3
    """Frames that are looked at for these gains."""

    room_texels: Count = 2
    """Side of the squares over which gains are summed, texels."""

    gain_limit: Annotated[float, Field(gt=1, le=1e6)] = 6.0
    """One ray counts at most so many times the gain asked for, so that skin does not keep a black wing beside it."""

    beside_gain: Weight = 0.003
    """As `room_gain`, for paint on pixels that do not show the subject (`outlines`). 0: none."""

    beside_share: Share = 0.5
    """Pixels of which the subject covers less than this share do not show it."""

    beside_cameras: Count = 24
    """Training cameras in whose pictures the subject is looked for."""

    speck_opacity: Share = 0.3
    """Patches of texels that are more opaque, in any frame, are compared by size."""

    speck_share: Share = 0.02
    """Patches smaller than this share of the largest are made transparent. 0 keeps them."""

    speck_reach: Natural = 3
    """Width of the soft edge around patches that stay, texels."""
