"""Which pixels of training pictures show the subject: what layers show on others is painted room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facefolds_core.captures.scene import Scene
from facefolds_core.params import ExplicitParams
from facefolds_core.progress import progress
from facefolds_core.spacing import spread
from facefolds_core.training.mattes.find import beside_plates, from_pictures, small
from facefolds_core.training.volume.fit import Volume


@dataclass(frozen=True)
class Silhouettes:
    """Mattes of some training cameras in one frame.

    Attributes:
        frame: index in the scene.
        row: (C,) of each training camera in `opacity`, -1 for those without.
        opacity: (K, pixels) uint8, of the subject.
    """

    frame: int
    row: NDArray[np.int64]
    opacity: NDArray[np.uint8]

    def of(self, camera: NDArray[np.integer], pixel: NDArray[np.integer]) -> NDArray[np.float32]:
        """(P,) cameras (positions in the list of training cameras) and pixels -> (P,) in [0, 1], NaN where unknown."""
        row = self.row[camera]
        shares = self.opacity[np.maximum(row, 0), pixel].astype(np.float32) / 255
        return np.where(row >= 0, shares, np.float32(np.nan))


def silhouettes(scene: Scene, volume: Volume, params: ExplicitParams) -> Silhouettes | None:
    """Of the volume's frame: mattes that the training may use; else what differs from clean plates; else what is cut
    out of the pictures, where there are enough to vote. None where nothing is known or nothing is asked for.

    Args:
        volume: with the subject alone in it.
    """
    if params.pruning.beside_gain == 0:
        return None
    frame, training, mattes = volume.frame, scene.indices("train"), scene.open_mattes()
    places = spread(range(len(training)), params.pruning.beside_cameras)
    pictures = [(training[place], frame) for place in places]
    known = {key: mattes.image(*key).reshape(-1) for key in pictures if mattes is not None and key in mattes}
    rest = [key for key in pictures if key not in known]
    found = beside_plates(scene, rest, params.outlines)
    plain = {(one.camera, one.frame) for one in found}
    rest = [key for key in rest if key not in plain]
    if rest and len(pictures) >= params.outlines.vote.min_views:
        sure = {key: small(scene, mattes.image(*key), params.outlines) for key in known if mattes is not None}
        sure |= {(one.camera, one.frame): one.matte for one in found}
        with progress(total=len(rest), desc="outlines", unit="picture") as bar:
            found += from_pictures(scene, volume, rest, params.outlines, bar, sure)
    known |= {
        (one.camera, one.frame): one.opacity(scene.height, scene.width).reshape(-1) for one in found if one.believed
    }
    if not known:
        return None
    row = np.full(len(training), -1)
    for number, (camera, _) in enumerate(known):
        row[training.index(camera)] = number
    return Silhouettes(frame, row, np.stack(list(known.values())))
