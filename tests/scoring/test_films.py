"""Films of held-out cameras: every frame comes back, truth left and asset right."""

from __future__ import annotations

import errno
from pathlib import Path

import av
import numpy as np
import pytest

from facefolds_core.files.writing import atomic_folder
from facefolds_core.scoring.films import FilmFolder
from tests.hostile.fuzz_disk import limited_files


def decoded(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") / 255 for frame in container.decode(video=0)]


@pytest.mark.parametrize("size", [(32, 24), (33, 25)])
def test_every_frame_comes_back_side_by_side(tmp_path: Path, size: tuple[int, int]) -> None:
    height, width = size
    greys = [0.2, 0.5, 0.8]
    folder = FilmFolder(tmp_path, 30.0)
    with folder.roll("a/b") as roll:
        assert roll is not None
        for k, grey in enumerate(greys):
            roll.add(f"{k:03d}", np.full((height, width, 3), grey), np.full((height, width, 3), 1 - grey))
    (film,) = folder.files
    assert (film.camera, film.frames, film.fps) == ("a/b", ("000", "001", "002"), 30)
    pictures = decoded(tmp_path / film.file)
    assert len(pictures) == 3
    for picture, grey in zip(pictures, greys, strict=True):
        assert picture.shape[1] == 2 * width
        np.testing.assert_allclose(picture[: height - 2, 2 : width - 4].mean(), grey, atol=0.02)
        np.testing.assert_allclose(picture[: height - 2, width + 4 : -4].mean(), 1 - grey, atol=0.02)


def test_a_single_frame_and_a_still_scene_are_no_film(tmp_path: Path) -> None:
    folder = FilmFolder(tmp_path, 30.0)
    for camera in ("a@0", "a@1"):  # as a stabilised scene has them
        with folder.roll(camera) as roll:
            assert roll is not None
            roll.add("0", np.zeros((16, 16, 3)), np.ones((16, 16, 3)))
    still = FilmFolder(tmp_path / "still", 0.0)
    with still.roll("a") as roll:
        assert roll is None
    assert folder.files == still.files == list(tmp_path.glob("still/*")) == []


def test_a_film_that_may_not_grow_is_named(tmp_path: Path) -> None:
    with (
        pytest.raises(OSError) as caught,
        limited_files(198),
        atomic_folder(tmp_path / "evaluation") as folder,
        FilmFolder(folder, 30.0).roll("a") as roll,
    ):
        assert roll is not None
        for frame in ("0", "1"):
            roll.add(frame, np.zeros((16, 16, 3)), np.ones((16, 16, 3)))
    named = tmp_path / "evaluation" / "films" / "000.mp4"
    assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(named))
    assert list(tmp_path.iterdir()) == []
