"""`train.pruning`: what a trained model does without."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from facefolds_core.params.base import Count, Natural, Section, Share, Weight


class PruningParams(Section):
    """What is left out of the trained model."""

    layer_alpha: Share = 1 / 255
    """An outer or inner layer whose alpha is nowhere larger is dropped: no pixel changes by more than this."""

    texel_opacity: Share = 1 / 1020
    """Texels that add less to the opacity of every training ray that was looked at (in each frame one ray in several,
    some `rays_per_texel` a texel; all of them over the frames) are made transparent. A ray reads four a layer: its
    colour changes by no more than N / 255, and that only if all of them are just below."""

    room_gain: Weight = 0.001
    """Directions in which the layers show the training pictures by less than this better than the bare background does
    (mean squared error, of values in [0, 1]) are made transparent: paint that looks like the room. 0: none."""

    beside_layers_gain: Weight = 0.0003
    """The same, with what is seen beside the layers and drawn on below them for the background: where layers are opaque
    nothing is learnt. 0: what was learnt alone counts. Nothing is cleared for looking like the room where this,
    `room_gain` and `beside_gain` are 0."""

    beside_layers_opacity: Share = 0.05
    """Pixels show what is beside the layers where these are less opaque than this."""

    room_frames: Count = 3
    """Frames that are looked at for that,"""

    room_texels: Count = 2
    """in squares of so many texels a side."""

    gain_limit: Annotated[float, Field(gt=1, le=1e6)] = 6.0
    """Before what is seen beside the layers one ray gains or loses at most so many times what is asked: skin beside a
    black wing, or a single speck in it, does not keep it. Where one ray in so many gains that much, paint stays."""

    beside_gain: Weight = 0.003
    """The same, where the paint is seen on pixels that do not show the subject (`outlines`): there it may look less
    like the room. 0: none. With 0.01 nothing was left of `mugsy`'s black wings, but of `moving` dark hair went that
    cut-outs lacked."""

    beside_share: Share = 0.5
    """Such are pixels of which the subject covers less than this, on average,"""

    beside_cameras: Count = 24
    """in the pictures of so many training cameras, of the starting volume's frame: their mattes where there are some,
    else what differs from their clean plates, else what is cut out of them."""

    speck_opacity: Share = 0.3
    """Of all layers together, in any frame: patches of texels that are more opaque are compared by size,"""

    speck_share: Share = 0.02
    """and those smaller than this share of the largest one are made transparent, with all that is farther than
    `speck_reach` from the others: splinters beside the head, that cameras left over. 0 keeps them."""

    speck_reach: Natural = 3
    """Texels: the soft edge of what stays."""
