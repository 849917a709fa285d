"""The subject, found once: its Gaussians, its opacity in every picture, and what single cameras do differently."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.files.reading import is_there
from facefolds_core.geometry.cameras import Camera
from facefolds_core.params import SubjectParams
from facefolds_core.spacing import spread
from facefolds_core.subject.body import body_among
from facefolds_core.subject.cameras import CameraFit
from facefolds_core.subject.cut_out import Image
from facefolds_core.subject.drawing import draw, view_of
from facefolds_core.subject.fit import fit_pictures
from facefolds_core.subject.foreign import read_start
from facefolds_core.subject.found import joined, no_subject, reference_frame
from facefolds_core.subject.gaussians import GaussianMethod
from facefolds_core.subject.hull import contradicted, looks_like
from facefolds_core.subject.mattes import Key, Mattes, Source
from facefolds_core.subject.splats import Splats
from facefolds_core.subject.storage import BODY, Body, FoundSubject, read_body, read_found

Array = NDArray[np.float32]

VIEWS = 24
"""Pictures that tell where the subject is: of a head that turns before fewer cameras, those of several frames."""
LOOKED_AT = 40_000
"""Pixels of a camera by which its gain is told, at most."""

SURE_OPACITY = 0.99
"""Pixels that are as opaque are the subject's alone, and tell a camera's gain."""

DEFAULT_SUBJECT = SubjectParams()
"""Of a subject that is found where no stage `subject` is: while `normalize` looks for poses in pictures, since a change
of the section `subject` shall not make every capture be normalised again."""


@dataclass(frozen=True)
class CutPicture:
    """A training picture and the subject in it.

    Attributes:
        key: of the picture.
        colours: (H, W, 3) times opacity.
        opacity: (H, W).
        source: whence its matte is.
        doubtful: (H, W, 4) where its opacity may be wrong, see `fit.TargetPicture`; None where nothing is doubted.
    """

    key: Key
    colours: Array
    opacity: Array
    source: Source
    doubtful: Array | None = None


def frames_looked_at(scene: Scene) -> list[int]:
    """The reference frame; of a head that turns before few cameras others as well, spread over the take."""
    first = reference_frame(scene)
    if scene.poses is None:
        return [first]
    count = math.ceil(VIEWS / max(1, len(scene.indices("train")))) - 1
    return list(dict.fromkeys([first, *spread(range(scene.num_frames), count)]))


def find_subject(
    scene: Scene, params: SubjectParams, named: Mapping[Key, Image] | None = None, start: Path | None = None
) -> tuple[FoundSubject, Mattes]:
    """Gaussians of the subject alone, and what makes the mattes of all pictures.

    Where the mattes of the pictures looked at are known, Gaussians are fitted to the subject cut out of them. Else
    they are fitted to whole pictures of one frame first, told apart from the room, and then trained on with the subject
    cut out. Then they are trained on once more, with mattes that know them: a picture that contradicted the first fit
    was cut out with room hanging before the subject, which left a hole in it.

    Args:
        named: mattes that the user has corrected.
        start: PLY of Gaussians, in place of our own fit.

    Raises:
        UserError: if nothing is found; see `read_start`.
    """
    store, how, mattes, begun = scene.open_frames(), method_for(params, scene), Mattes(scene, named), None
    keys = [(c, k) for k in frames_looked_at(scene) for c in scene.indices("train") if (c, k) in store]
    training = set(scene.indices("train"))
    if start is not None or not all(mattes.known(key) for key in store if key[0] in training):
        mattes = Mattes(scene, named, _body(scene, how, params.seed, start))
        begun = mattes.begun()
    views = _views(scene, mattes, keys)
    if not any((view.opacity > 0.5).any() for view in views):
        raise _nothing(scene)
    if start is None:
        mattes.alone = _fit_alone(scene, _doubted(scene, mattes, views, how.ball), how, params.seed, begun)
        views = _views(scene, mattes, keys)
        splats = _fit_alone(scene, views, how, params.seed, mattes.alone)
    else:
        assert begun is not None
        splats = begun.part(joined(begun, scene))
    mattes.alone = splats
    fit, psnr = judged(scene, splats, views)
    return FoundSubject(splats, psnr, fit, mattes.torso()), mattes


def _agreeing(scene: Scene, mattes: Mattes, keys: Sequence[Key]) -> list[Key]:
    """The pictures that one body can show: of one frame, where a part of it stands still while the rest turns, or
    where that is not known yet."""
    told = mattes.body is not None or mattes.alone is not None
    if len({frame for _, frame in keys}) < 2 or (told and not mattes.anything_stands):
        return list(keys)
    return [key for key in keys if key[1] == reference_frame(scene)]


def _fit_alone(
    scene: Scene, views: Sequence[CutPicture], how: GaussianMethod, seed: int, begun: Splats | None
) -> Splats:
    """Gaussians of the subject cut out of pictures, what floats apart left out."""
    cameras, opacities = [scene.camera_in_head(*view.key) for view in views], [view.opacity for view in views]
    colours, doubtful = [view.colours for view in views], [view.doubtful for view in views]
    splats = fit_pictures(cameras, colours, how, seed, opacities, begun, doubtful)
    return splats.part(joined(splats, scene))


def fit_room(scene: Scene, frame: int, params: GaussianMethod, seed: int = 0) -> Splats:
    """Gaussians of the training pictures of one frame, room included."""
    return fit_pictures(*pictures_of(scene, frame, scene.indices("train")), params, seed)


def pictures_of(scene: Scene, frame: int, cameras: Sequence[int]) -> tuple[list[Camera], list[Array]]:
    """Those of some cameras that have a picture of the frame, and the pictures, (H, W, 3) float32 in [0, 1]."""
    store = scene.open_frames()
    there = [i for i in cameras if (i, frame) in store]
    pictures = [store.image(i, frame).astype(np.float32) / np.float32(255) for i in there]
    return [scene.camera_in_head(i, frame) for i in there], pictures


def method_for(params: SubjectParams, scene: Scene) -> GaussianMethod:
    """How they are fitted."""
    ball = GaussianMethod.ball if scene.radius is None else scene.radius
    return GaussianMethod(iterations=params.iterations, fewest=params.fewest, most=params.most, ball=ball)


def _views(scene: Scene, mattes: Mattes, keys: Sequence[Key]) -> list[CutPicture]:
    """Training pictures that agree, with the subject cut out of them."""
    found = [(key, mattes.of(key)) for key in _agreeing(scene, mattes, keys)]
    return [CutPicture(key, *mattes.cut(key, matte), matte.source) for key, matte in found]


def _doubted(scene: Scene, mattes: Mattes, views: Sequence[CutPicture], ball: float) -> list[CutPicture]:
    """The views; what one shows beside a plate is doubted where all others of its frame contradict it and it looks like
    the subject nearby."""
    found = list[CutPicture]()
    for frame in dict.fromkeys(view.key[1] for view in views):
        those = [view for view in views if view.key[1] == frame]
        if all(view.source != "plate" for view in those):
            found += those
            continue
        cameras, silhouettes = [scene.camera_in_head(*view.key) for view in those], [v.opacity > 0.5 for v in those]
        against = contradicted(cameras, silhouettes, ball)
        pairs = zip(those, against, strict=True)
        found += [
            _in_doubt(view, mattes.picture(view.key), one) if view.source == "plate" else view for view, one in pairs
        ]
    return found


def _in_doubt(view: CutPicture, picture: Array, against: NDArray[np.bool_]) -> CutPicture:
    """A view whose picture (H, W, 3) others contradict (H, W)."""
    doubted = np.dstack([picture, np.ones_like(view.opacity)])
    return replace(view, doubtful=doubted * (against & looks_like(picture, view.opacity))[..., None])


def judged(scene: Scene, splats: Splats, views: Sequence[CutPicture]) -> tuple[CameraFit, float]:
    """What single cameras do differently, and PSNR over the pictures, dB."""
    train, parts, squares = scene.indices("train"), list[tuple[Array, Array, Array, NDArray[np.int32]]](), []
    for view in views:
        rgb, light = draw(splats.values, view_of(scene.camera_in_head(*view.key))).picture()
        squares.append(float(np.square(rgb - view.colours).mean()))
        sure = np.flatnonzero((view.opacity > SURE_OPACITY).reshape(-1))
        sure = sure[:: max(1, len(sure) // LOOKED_AT)]
        colours, seen = (image.reshape(-1, 3)[sure] for image in (rgb, view.colours))
        camera = np.full(len(sure), train.index(view.key[0]), np.int32)
        parts.append((colours, 1 - light.reshape(-1)[sure], seen, camera))
    shown, alpha, photos, numbers = (np.concatenate(each) for each in zip(*parts, strict=True))
    fit = CameraFit.of(shown, alpha, photos, numbers, len(train))
    return fit, -10 * math.log10(max(float(np.mean(squares)), 1e-10))


def subject_in(scene: Scene) -> FoundSubject:
    """The subject that was found before.

    Raises:
        UserError: if it was not.
    """
    path = scene.found_gaussians()
    if path is None or scene.open_mattes() is None:
        remedy = f"run `dvc repro subject@{scene.subject}` first"
        raise UserError("the subject of this scene has not been found", file=scene.folder, remedy=remedy)
    return read_found(path, len(scene.indices("train")))


def _body(scene: Scene, how: GaussianMethod, seed: int, start: Path | None) -> Body:
    """The subject among Gaussians of the whole scene: of those that poses were found with, if there are some."""
    known, frame = scene.folder / BODY, reference_frame(scene)
    if start is None and is_there(known):
        return read_body(known, scene.num_frames)
    splats = fit_room(scene, frame, how, seed) if start is None else read_start(start, scene, frame)
    body = body_among(scene, splats, frame)
    if not body.subject.any():
        raise _nothing(scene)
    return body


def _nothing(scene: Scene) -> UserError:
    return no_subject(f"frame {scene.frame_ids[reference_frame(scene)]}", scene.folder)
