"""What a manifest says beside the levels: sound, pictures, the head's motion, the range that was filmed."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from pydantic import AfterValidator, Field

from facefolds_core.asset.manifest_base import Count, Maybe, Offset, Part, Row, StoredFile, Vector
from facefolds_core.geometry.torso import Torso


class Picture(StoredFile):
    """A picture of `width` x `height` pixels."""

    width: Count
    height: Count


class Poster(Picture):
    """A still picture of the asset's first frame, shown while it loads.

    Attributes:
        K, w2c: the camera that shows the same, as a photo's; absent where it is not known.
        background: stored values in [0, 1] behind the layers; absent where it is not known.
    """

    K: Maybe[tuple[Vector, Vector, Vector]] = None
    w2c: Maybe[tuple[Row, Row, Row]] = None
    background: Maybe[Vector] = None


class Photo(Picture):
    """A photo of the capture and the camera that took it, to compare with.

    Attributes:
        camera, frame: the capture's name of the camera, the index of the frame.
        K: intrinsics, rows; continuous pixel coordinates.
        w2c: (R | t), rows: normalised coordinates to OpenCV's camera axes.
    """

    camera: str
    frame: Offset
    K: tuple[Vector, Vector, Vector]
    w2c: tuple[Row, Row, Row]


class Audio(StoredFile):
    """The sequence's sound, from frame 0 on.

    Attributes:
        mime: MIME type with codec string, as browsers take it; absent where it is not known.
    """

    mime: Maybe[str] = None


def _rising(value: tuple[float, float]) -> tuple[float, float]:
    if not value[0] <= value[1]:
        raise ValueError("from the lower to the higher")
    return value


def _a_turn(value: tuple[float, float]) -> tuple[float, float]:
    if value[1] > value[0] + 360:
        raise ValueError("at most a full turn")
    return value


Longitude = Annotated[float, Field(ge=-360, le=360)]
Latitude = Annotated[float, Field(ge=-90, le=90)]
Distance = Annotated[float, Field(ge=0)]


class Directions(Part):
    """A range of directions, seen from the origin.

    Attributes:
        azimuth: degrees from +x towards +y; its middle is in [-180, 180].
        elevation: degrees.
    """

    azimuth: Annotated[tuple[Longitude, Longitude], AfterValidator(_rising), AfterValidator(_a_turn)]
    elevation: Annotated[tuple[Latitude, Latitude], AfterValidator(_rising)]


class FilmedView(Directions):
    """Directions that the subject was filmed from: a player need not go beyond them. `azimuth` is the smallest arc with
    all training cameras, `elevation` their range.

    Attributes:
        distance: the range of the training cameras, units; absent where it is not known.
        measured: (azimuth, elevation, distance) of cameras that training did not see and that quality is measured
            with; absent where there are none.
        good: where the picture is good, as far as the asset's own pictures tell; absent where that was not measured.
    """

    distance: Maybe[Annotated[tuple[Distance, Distance], AfterValidator(_rising)]] = None
    measured: Maybe[tuple[Vector, ...]] = None
    good: Maybe[Directions] = None


class StandingTorso(Part):
    """What stays in the room while the head turns: all that lies beyond a plane (`geometry/torso.py`).

    In frame k a vertex x of the meshes is in the world at (1 - s) M_k x + s M x. There s = (normal.x - offset) / band,
    from 0 to 1, M_k is the frame's pose in `track_file`, and M that of `quaternion` and `translation`.

    Attributes:
        normal: of unit length, from the head to the torso, in the axes of the meshes.
        offset: where vertices begin to stay, units.
        band: within which they come to stay, units.
        quaternion: w, x, y, z.
        translation: units.
    """

    normal: Vector
    offset: float
    band: Annotated[float, Field(gt=0)]
    quaternion: tuple[float, float, float, float]
    translation: Vector

    @classmethod
    def of(cls, torso: Torso) -> StandingTorso:
        return cls(**asdict(torso))

    def torso(self) -> Torso:
        """As renderers take it."""
        return Torso(self.normal, self.offset, self.band, self.quaternion, self.translation)


class Stream(Part):
    """The same videos, and the sound, for players of DASH and HLS.

    Attributes:
        dash: the manifest (MPD).
        hls: the main playlist, and those of the tracks that it names.
    """

    dash: StoredFile
    hls: Annotated[tuple[StoredFile, ...], Field(min_length=1)]
