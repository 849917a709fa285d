"""Figures as people read them, and the summary: sentences that hold nothing but measured figures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from facefolds_core.asset.manifest import Manifest
from facefolds_core.captures.scene import Scene
from facefolds_core.reporting.facts import Facts, ImageScores, StageCost, finite
from facefolds_core.scoring.record import AngleBin, Seen
from facefolds_core.scoring.report import headline
from facefolds_core.scoring.terminal import HEADLINE_WORDS, REGION_WORDS, SPLIT_WORDS

NONE = "–"
"""Stands for a value that is not there."""
LEAST_SHARE = 0.01
"""Of the subject's pixels: angles that fewer have are not spoken of."""
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


def percent(share: Any, digits: int = 1) -> str:
    found = finite(share)
    return NONE if found is None else f"{100 * found:.{digits}f}\u00a0%"


def plural(amount: int, one: str, many: str | None = None) -> str:
    return f"{count(amount)} {one if amount == 1 else many or one + 's'}"


def listed(names: list[str]) -> str:
    """ "a", "a and b", "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def quality_key(metrics: dict[str, Any]) -> str:
    """The PSNR that says most: the first of HEADLINES that is there."""
    return headline(metrics)


def region_words(metrics: dict[str, Any]) -> str:
    """Over which pixels `quality_key` is taken; and what says so, where that is noted."""
    key = quality_key(metrics)
    by = REGION_WORDS.get(metrics.get("matte", "")) if key in ("psnr_subject", "psnr_found") else None
    return f"{HEADLINE_WORDS[key]}, the pixels of {by}" if by else HEADLINE_WORDS[key]


def image_psnr(image: ImageScores, key: str) -> float | None:
    value: float | None = getattr(image, key)
    return value


def curve_name(series: str) -> str:
    """Of a series of the training log."""
    return CURVES.get(series, series.replace("/", ": ").replace("_", " "))


def capture_words(scene: Scene) -> str:
    frames = plural(scene.num_frames, "frame")
    if scene.num_frames > 1 and scene.fps > 0:
        frames += f" ({number(scene.num_frames / scene.fps, 1)} s at {number(scene.fps, 0)} a second)"
    train, checked, held = (len(scene.indices(split)) for split in ("train", "validate", "holdout"))
    aside = f"{count(checked)} set aside for choices, " if checked else ""
    return (
        f"The capture: {frames} of {plural(len(scene.cameras), 'camera')}, {scene.width} × {scene.height} pixels; "
        f"{count(train)} of them trained the model, {aside}{count(held)} {'was' if held == 1 else 'were'} held out."
    )


def asset_words(manifest: Manifest) -> str:
    level = manifest.full
    meshes, video = sum(layer.bytes for layer in level.layers), level.texture.videos[0].bytes
    frames, fps = level.texture.frames, level.texture.fps
    rate = f", {number(video * 8e-6 * fps / frames, 1)} Mbit a second" if frames > 1 else ""
    triangles = sum(layer.triangles for layer in level.layers)
    return (
        f"The asset: {plural(len(level.layers), 'layer')} with {count(triangles)} triangles, {size(meshes)} of meshes "
        f"and {size(video)} of texture video{rate}."
    )


def quality_words(metrics: dict[str, Any]) -> str:
    """The asset's means, what the export cost, and what the whole frame says."""
    key = quality_key(metrics)
    asset, diffuse = metrics.get("asset", {}), metrics.get("diffuse", {})
    ssim, high = asset.get(key.replace("psnr", "ssim")), asset.get("ssim_high")
    images = metrics.get("images_with_mask" if key == "psnr_subject" else "images")
    text = f"On {count(images)} held-out pictures the asset reaches {number(asset.get(key))} dB PSNR"
    text += f" {region_words(metrics)}" if ssim is None else f" and {number(ssim, 3)} SSIM {region_words(metrics)}"
    text += "." if high is None else f", and {number(high, 3)} SSIM of high frequencies."
    here, before = finite(asset.get(key)), finite(diffuse.get(key))
    if here is not None and before is not None:
        loss = before - here
        text += (
            f" The model without its view branch, of which the asset is made, reaches {number(before)} dB: "
            f"the export {'costs' if loss >= 0 else 'adds'} {number(abs(loss))} dB."
        )
    inside, band = finite(asset.get("psnr_interior")), finite(asset.get("psnr_band"))
    along = finite(asset.get("psnr_band_over_plate")) or band
    if inside is not None and along is not None:
        text += f" Inside its outline it is {number(inside)} dB, along it {number(along)} dB."
    temporal = finite(asset.get("temporal"))
    if temporal is not None:
        text += f" It shows {percent(temporal, 0)} of what changes from frame to frame."
    if key == "psnr":
        text += " It is not known where the subject is: what the layers do not show of the room counts as an error."
    return text


def extremes_words(images: tuple[ImageScores, ...], key: str) -> str | None:
    known = [(value, image) for image in images if (value := image_psnr(image, key)) is not None]
    if len(known) < 2:
        return None
    worst, best = min(known, key=lambda one: one[0]), max(known, key=lambda one: one[0])
    return (
        f"The worst held-out picture is camera {worst[1].camera}, frame {worst[1].frame}, with {number(worst[0])} dB; "
        f"the best is camera {best[1].camera}, frame {best[1].frame}, with {number(best[0])} dB."
    )


def angle_words(seen: Seen) -> str | None:
    """Where the error is least and greatest, of the angles that matter; holes, where masks show them."""
    known = [(one.rms, one) for one in seen.angles if one.rms is not None and one.share >= LEAST_SHARE]
    if len(known) < 2:
        return None
    least, most = min(known, key=lambda one: one[0]), max(known, key=lambda one: one[0])
    text = (
        f"By the angle between the view and the surface's normal, the root mean square error is least at "
        f"{span(least[1])} ({number(least[0], 3)} of the full range) and greatest at {span(most[1])} "
        f"({number(most[0], 3)})."
    )
    if not seen.masked:
        return text
    bare = seen.bare.share
    holes = "None" if bare == 0 else "Less than 0.1\u00a0%" if bare < 0.001 else percent(bare)
    return f"{text} {holes} of the subject's pixels {'meets' if holes == 'None' else 'meet'} no layer."


def span(one: AngleBin) -> str:
    return f"{one.low:.0f}°–{one.high:.0f}°"


def layer_words(seen: Seen) -> str:
    """The fewest layers that make up half of what is seen, and the weakest one."""
    shares = np.array(seen.contribution)
    order = np.argsort(-shares, kind="stable")
    needed = int(np.searchsorted(np.cumsum(shares[order]), 0.5)) + 1
    strongest = sorted(int(i) + 1 for i in order[:needed])
    weakest = int(order[-1])
    return (
        f"{percent(shares[order[:needed]].sum(), 0)} of what is seen comes from "
        f"{'layer' if needed == 1 else 'layers'} {listed([str(i) for i in strongest])}, counted from outside; "
        f"layer {weakest + 1} adds least, {percent(shares[weakest])}, and to no pixel more than "
        f"{number(seen.greatest[weakest])}."
    )


def export_words(steps: tuple[dict[str, Any], ...]) -> str | None:
    """The step of the export that loses most."""
    values = [finite(step.get("psnr")) for step in steps]
    changes = [
        (after - before, step.get("name", NONE))
        for (before, after), step in zip(pairwise(values), steps[1:], strict=True)
        if before is not None and after is not None
    ]
    if not changes:
        return None
    change, name = min(changes)
    if change >= 0:
        return "No step of the export loses PSNR."
    return f"Of the export's steps, “{name}” loses most: {number(-change)} dB."


def waterfall_words(found: dict[str, Any]) -> str:
    """On which pictures the steps of the export were measured, and over which pixels; an older file does not say."""
    cameras, region = SPLIT_WORDS.get(found.get("split", "")), REGION_WORDS.get(found.get("region", ""))
    if cameras is None or region is None:
        return "Each step as its stage left it"
    pictures = plural(found.get("images", 0), "picture")
    return f"{pictures} of cameras {cameras}, the pixels of {region}; each step as its stage left it"


def time_words(metrics: dict[str, Any], training: dict[str, Any] | None, stages: tuple[StageCost, ...]) -> str:
    cost = metrics.get("cost", {})
    preset = (training or {}).get("preset")
    text = f"Training took {duration(cost.get('train_seconds'))} on {cost.get('device', 'an unknown device')}"
    text += f" with the preset {preset}" if preset else ""
    iterations = finite(cost.get("iterations"))
    text += "." if iterations is None else f", {plural(int(iterations), 'iteration')}."
    timed = [(stage.seconds, stage.name) for stage in stages if stage.seconds is not None]
    if timed:
        longest = max(timed)
        total = sum(seconds for seconds, _ in timed)
        text += (
            f" All stages together took {duration(total)}, the longest of them {longest[1]} ({duration(longest[0])})."
        )
    return text


def summary(facts: Facts, manifest: Manifest, scene: Scene | None, seen: Seen | None) -> list[tuple[str, list[str]]]:
    """Headings and their sentences; what is not known is left out."""
    groups = [
        ("What it is", [capture_words(scene) if scene else None, asset_words(manifest)]),
        ("How near it comes", [quality_words(facts.metrics), extremes_words(facts.images, quality_key(facts.metrics))]),
        (
            "What is seen",
            [angle_words(seen), layer_words(seen)] if seen else [],
        ),
        ("What it took", [time_words(facts.metrics, facts.training, facts.stages), export_words(facts.waterfall)]),
    ]
    said = [(heading, [sentence for sentence in group if sentence]) for heading, group in groups]
    return [(heading, group) for heading, group in said if group]


def frame_label(frames: Sequence[str], name: str) -> str:
    """A frame as it is called everywhere: the capture's name, and its place as the player counts, from 1."""
    return f"{name} ({frames.index(name) + 1} of {len(frames)})" if name in frames else name
