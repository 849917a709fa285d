"""`train.pruning`: what a trained model does without."""

from __future__ import annotations

from facefolds_core.params.base import Section, Share


class PruningParams(Section):
    """What is left out of the trained model."""

    texel_opacity: Share = 1 / 1020
    """Texels that add less to the opacity of every training ray looked at are made transparent."""

    speck_share: Share = 0.02
    """Opaque patches smaller than this share of the largest are made transparent. 0 keeps them."""
