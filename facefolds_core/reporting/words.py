"""Figures as people read them, and the summary: sentences that hold nothing but measured figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from facefolds_core.reporting.facts import finite
from facefolds_core.scoring.report import headline
from facefolds_core.scoring.terminal import HEADLINE_WORDS, REGION_WORDS

NONE = "–"
"""Stands for a value that is not there."""
CURVES = {"psnr": "PSNR on training rays, dB", "texel_rows": "rows of texels", "rays_per_second": "rays a second"}


def number(value: Any, digits: int = 2) -> str:
    """A number with so many digits after the point, thousands apart; NONE for what is no finite number."""
    found = finite(value)
    return NONE if found is None else f"{found:,.{digits}f}".replace(",", "\u202f").replace("-", "−")


def count(value: Any) -> str:
    return number(value, 0)


def size(value: Any) -> str:
    """Bytes; 1 KB is 1000 of them."""
    found = finite(value)
    if found is None:
        return NONE
    for limit, unit in ((1e9, "GB"), (1e6, "MB")):
        if found >= limit:
            return f"{found / limit:.{2 if found < 10 * limit else 1 if found < 100 * limit else 0}f}\u00a0{unit}"
    if found >= 1e3:
        return f"{found / 1e3:.0f}\u00a0KB"
    return f"{found:.0f}\u00a0bytes"


def asset_bytes(metrics: dict[str, Any]) -> float | None:
    """Of the full level, one video of it: meshes, video and reflection; None where that was not counted."""
    cost = metrics.get("cost") or {}
    return sum(finite(cost.get(name)) or 0.0 for name in ("mesh_bytes", "texture_bytes", "reflection_bytes")) or None


def duration(seconds: Any) -> str:
    found = finite(seconds)
    if found is None:
        return NONE
    if found < 9.95:
        return f"{found:.1f}\u00a0s"
    if found < 120:
        return f"{found:.0f}\u00a0s"
    minutes, rest = divmod(round(found), 60)
    return f"{minutes}\u00a0min {rest}\u00a0s" if minutes < 120 else f"{minutes // 60}\u00a0h {minutes % 60}\u00a0min"


def percent(share: Any) -> str:
    found = finite(share)
    return NONE if found is None else f"{100 * found:.0f}\u00a0%"


def region_words(metrics: dict[str, Any]) -> str:
    """Over which pixels the headline is taken; and what says so, where that is noted."""
    key = headline(metrics)
    by = REGION_WORDS.get(metrics.get("matte", "")) if key in ("psnr_subject", "psnr_found") else None
    return f"{HEADLINE_WORDS[key]}, the pixels of {by}" if by else HEADLINE_WORDS[key]


def curve_name(series: str) -> str:
    """Of a series of the training log."""
    return CURVES.get(series, series.replace("/", ": ").replace("_", " "))


def frame_label(frames: Sequence[str], name: str) -> str:
    """A frame as it is called everywhere: the capture's name, and its place as the player counts, from 1."""
    return f"{name} ({frames.index(name) + 1} of {len(frames)})" if name in frames else name
