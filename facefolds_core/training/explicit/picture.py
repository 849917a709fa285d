"""What the fit chose, as a picture: `fit.png` of the model folder."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from facefolds_core.training.explicit.fit import Fit


def draw_fit(path: Path, fit: Fit, layers: int, subject_opacity: float) -> None:
    """Maps over the window as seen from the front, and what each centre would lose of the visible surface.

    Args:
        subject_opacity: from which on a direction is taken to hold the subject.
    """
    with matplotlib.rc_context({"font.size": 9}):
        figure = Figure(figsize=(14, 3.6), layout="constrained")
        axes = figure.subplots(1, 5)
        u0, u1, v0, v1 = fit.window
        extent = (v0, v1, u0, u1)
        hidden = np.ma.masked_where(fit.opacity < subject_opacity, fit.middle)
        axes[0].imshow(fit.rgb.clip(0, 1), extent=extent)
        axes[0].set_title("colour at the start")
        axes[1].imshow(fit.opacity, extent=extent, vmin=0, vmax=1, cmap="gray")
        axes[1].set_title("opacity at the start")
        for axis, values, title in (
            (axes[2], hidden, "middle radius"),
            (axes[3], fit.halfwidth, f"half of the space of {layers} layers"),
        ):
            figure.colorbar(axis.imshow(values, extent=extent, cmap="viridis"), ax=axis, shrink=0.8)
            axis.set_title(title + ", units")
        for axis in axes[:4]:
            axis.set_xlabel("v")
            axis.set_ylabel("u")
        colours = ["tab:orange" if chart == fit.chart else "tab:blue" for chart in fit.losses]
        losses = [100 * loss for loss in fit.losses.values()]
        axes[4].barh([str(chart) for chart in fit.losses], losses, color=colours)
        axes[4].set_title("visible surface lost, %")
        axes[4].set_ylabel("x of the centre, degrees of the belt (orange: chosen)")
        figure.suptitle(
            f"centre x = {fit.chart}   window u {u0:.2f}..{u1:.2f}, v {v0:.2f}..{v1:.2f}   "
            f"texels {fit.texels[0]} x {fit.texels[1]}   layers {layers}"
        )
        figure.savefig(path, dpi=90)
