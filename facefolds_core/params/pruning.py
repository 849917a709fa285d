"""`train.pruning`: what a trained model does without."""

from __future__ import annotations

from facefolds_core.params.base import Natural, Section, Share


class PruningParams(Section):
    """What is left out of the trained model."""

    layer_alpha: Share = 1 / 255
    """Outer or inner layers whose alpha is nowhere larger are dropped: no pixel changes by more."""

    texel_opacity: Share = 1 / 1020
    """Texels that add less to the opacity of every training ray looked at are made transparent."""

    speck_opacity: Share = 0.3
    """Patches of texels that are more opaque, in any frame, are compared by size."""

    speck_share: Share = 0.02
    """Patches smaller than this share of the largest are made transparent. 0 keeps them."""

    speck_reach: Natural = 3
    """Width of the soft edge around patches that stay, texels."""
