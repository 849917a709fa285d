"""What a user should know of a step: records, with one place that words them.

A scene says what of its capture it left out, a training why it chose as it did and what happened to it. Code asks a
fact's kind and values; people read `str(fact)`. Files hold both: the record, and its words beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

WORDS = {
    # of a capture
    "camera_without_images": "camera {camera}: in KRT, but has no images",
    "camera_without_calibration": "camera {camera}: has images, but is not in KRT",
    "no_images": "camera {camera}: calibrated, but has no pictures",
    "uncalibrated": "camera {camera}: has pictures, but no calibration",
    "other_size": "camera {camera}: its pictures are {size[0]} x {size[1]}, those of most cameras {common[0]} x "
    "{common[1]}",
    "k_is_scaled": "note: K is for larger or smaller pictures than {size[0]} x {size[1]}; scaled ({cameras})",
    "masks_chosen": "note: masks are those of the folder {chosen}; {others} are not read",
    "other_models": "note: sparse/0 is read; COLMAP's other models ({others}) do not hang together with it",
    "camera_incomplete": "camera {camera}: has {has} of {of} frames, fewer than half",
    "culled": "camera {camera}: culled, elevation {elevation:.1f}, azimuth {azimuth:.1f} degrees",
    "frame_without_images": "frame {frame}: in frame_list.txt, but no camera has an image",
    "frame_without_mesh": "frame {frame}: no tracked mesh or no head pose",
    "frame_incomplete": "frame {frame}: no image from {cameras}",
    "image_missing": "{place}: no image {image}",
    "no_mesh": "tracked mesh: none in {folder} with its _transform.txt; cameras give centre and orientation",
    "mesh_without_faces": "tracked mesh: {folder} has no .obj, so no faces; it gives centre and orientation only",
    "krt_is_scaled": "note: K of KRT is already scaled to the images (median principal point ({point[0]:.1f}, "
    "{point[1]:.1f}); images {image[0]} x {image[1]}); `krt_size` overrides",
    "krt_is_of_full_size": "note: K of KRT is for full-size images; scaled (median principal point ({point[0]:.1f}, "
    "{point[1]:.1f}); images {image[0]} x {image[1]}); `krt_size` overrides",
    "front_found": "note: no `front` and no tracked mesh: the subject is taken to face where most cameras stand, near "
    "camera {camera} ({share:.0%} of them within 60 degrees of there); if it does not, name one that it faces in "
    "`front`",
    "head_turns": "note: the head turns by up to {degrees:.1f} degrees and shifts by up to {shift:.1%} of its size: "
    "the model is made in its own frame, and the asset carries its poses ({source}); `stabilize` overrides",
    "head_turns_unheeded": "warning: the head turns by up to {degrees:.1f} degrees and shifts by up to {shift:.1%} of "
    "its size, and `stabilize: false` takes it to stand still: expect a blurred or doubled face",
    "poses_refused": "warning: the pictures of frame {frames} fit no pose of the head; they are given that between "
    "their neighbours'",
    "sound_does_not_fit": "{file}: the frames in use are not evenly spaced, so no sound fits them",
    "colours_corrected": "note: colours of {count} cameras are corrected by {file}",
    # of a training: why it chose as it did
    "centre_chosen": "chart: of the candidates that lose least of the visible surface, within {tie:.1%}, "
    "the one farthest back (it loses {lost:.1%})",
    "window_chosen": "window: directions in which the subject is at least {opacity:.0%} opaque (and the tracked mesh, "
    "where there is one), and {margin} on each side",
    "middle_from_volume": "middle radius: where half of the subject's opacity is reached from outside",
    "middle_from_mesh": "middle radius: the tracked mesh, mean over frames, but where the subject lies over {reach} "
    "outside it",
    "halfwidth_chosen": "halfwidth: {least}, more where the subject is blurred or far from the middle, at most {most}",
    "second_surface": "second surface: {layers} layers beneath the first in {share:.1%} of the directions, where "
    "cameras see something under an overhang",
    "texels_chosen": "texels: {pixels:g} pixels each, seen head on from the median training camera",
    "resolution_chosen": "{what}: auto took {chosen} of {tried}: {below:.2f} dB below the best of them on {views} "
    "views of cameras of the split {split}, {to_finest:.1f} dB to the finest one's pictures",
    # of a training: what happened
    "camera_contradicts": "camera {camera} is left out: on the subject it differs {times:.1f} times as much from what "
    "the others see as the median camera does; check its calibration",
    "gains": "cameras differ in exposure or white balance; taken out: gains r {r[0]:.2f} to {r[1]:.2f}, "
    "g {g[0]:.2f} to {g[1]:.2f}, b {b[0]:.2f} to {b[1]:.2f} (fit.json: cameras)",
    "mesh_is_off": "the tracked mesh is left out: in {share:.0%} of the directions it lies over {distance} units "
    "from what the images show (is its scale or its place wrong?)",
    "followed": "frames moved once more, where they did not follow what moves: {share:.1%} of the texels each",
    "layer_dropped": "layer {layer} dropped: alpha at most {alpha:.4f}",
    "reflection": "a reflection shared by layers and frames gains {gain:.2f} dB on cameras that its fit did not see",
    "smooth_reflection": "a reflection shared by layers and frames gains {gain:.2f} dB on cameras that its fit did not "
    "see, if its maps are {times:g} times as smooth as elsewhere ({fine:.2f} dB with finer ones)",
    "no_reflection": "no reflection: it would gain {gain:.2f} dB on cameras that its fit did not see, under {least:g}",
    "in_segments": "{frames} frames, trained as {segments} segments over a base of {keys} key frames (fit.json: "
    "key_frames)",
    "start_explains_little": "warning: the subject's Gaussians explain the pictures with {psnr:.1f} dB only (under "
    "{under:g}): look at subject/sheet.png, and check the calibration (docs/guide/subjects.md)",
    "surface_without_a_place": "warning: {share:.0%} of the visible surface have no place in the chart around "
    "x = {x:.2f}: it will be missing or torn; add candidates to train.start.centres or train.start.belts",
    "codec_misses": "warning: the video reaches {reached:.1f} dB of the {target:.1f} it was asked for: "
    "finer quantisation gives no more; finer textures (texture.resolution) do",
    "stands_still": "warning: the asset shows {asset:.0%} of what changes from frame to frame, the model {model:.0%} "
    "(under {under:.0%}): its film stands still where the subject moves. If both are low, train longer "
    "(train.iterations) or on fewer frames; if the asset alone is, lower bake.hold",
    "matte_is_found": "warning: no masks, and not of all scored pictures mattes: scores are taken where the model "
    "itself is opaque, so that one training's cannot be compared with another's. Give masks of the scored cameras, or "
    "run `dvc repro`, whose stage `subject` finds mattes (docs/guide/subjects.md)",
    "training_view_bad": "warning: training camera {camera} sees the asset with {psnr:.1f} dB only in frame {frame}, "
    "the median training camera with {median:.1f}: look at evaluation/pictures/training_{camera}.png (photo beside "
    "asset); is its calibration wrong, does something stand before the subject, or are there too few cameras on its "
    "side?",
    "front_is_guessed": "warning: `front` was guessed from the cameras' mean direction; name a camera that faces the "
    "subject",
}
"""Kind -> its words."""


WARNINGS = frozenset(
    {
        *("camera_contradicts", "mesh_is_off"),
        *("start_explains_little", "surface_without_a_place", "front_is_guessed"),
        *("codec_misses", "stands_still", "matte_is_found", "training_view_bad"),
    }
)
"""Kinds that ask for something to be done; the others are told for the record."""


@dataclass(frozen=True)
class Fact:
    """One thing that a user should know.

    Attributes:
        kind: a key of `WORDS`.
        values: what the words name: `camera` and `frame` by name, numbers, lists; as JSON has them.
    """

    kind: str
    values: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        """In words."""
        return WORDS[self.kind].format(**{key: _listed(value) for key, value in self.values.items()})

    @property
    def camera(self) -> str | None:
        """The camera that it is about, if it is about one."""
        return self.values.get("camera")

    def to_json(self) -> dict[str, Any]:
        return {"kind": self.kind, **self.values, "words": str(self)}


def fact(kind: str, **values: Any) -> Fact:
    """`fact("culled", camera="400002", elevation=61.0, azimuth=2.0)`."""
    return Fact(kind, values)


def read_fact(value: Any) -> Fact:
    """A fact of a file.

    Raises:
        ValueError: if it is none of ours.
    """
    if not isinstance(value, dict) or not isinstance(value.get("kind"), str) or value["kind"] not in WORDS:
        raise ValueError(f"{str(value)[:100]} is no fact")
    found = Fact(value["kind"], {key: part for key, part in value.items() if key not in ("kind", "words")})
    try:
        str(found)
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ValueError(f"{str(value)[:100]} has not what a fact of its kind has: {error!r}") from None
    return found


def worded(value: Any) -> str:
    """A fact of a file in words; what is none of ours, as it stands there."""
    try:
        return str(read_fact(value))
    except ValueError:
        return str(value)


def _listed(value: Any) -> Any:
    return shorten(value) if isinstance(value, list | tuple) and all(isinstance(v, str) for v in value) else value


def shorten(names: Sequence[str], most: int = 12) -> str:
    """A list in words: 'a, b, c and 40 more'."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
