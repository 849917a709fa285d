"""Which part of a volume is the subject."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from facefolds_core.facts import Fact
from facefolds_core.geometry.chart import Chart
from facefolds_core.params import ExplicitParams
from facefolds_core.training.volume import kernel
from facefolds_core.training.volume.cameras import CameraFit
from facefolds_core.training.volume.fit import Volume
from facefolds_core.training.volume.fog import clear_of_fog, closing, filled
from facefolds_core.training.volume.outline import profile, thickness
from facefolds_core.training.volume.room import Room
from facefolds_core.training.volume.search import cut_share, in_ball
from facefolds_core.training.volume.subject import EMPTY, body_at_centre, positions, subject_of
from facefolds_core.training.volume.walls import Wall

PARAMS = ExplicitParams()
REACH, VOXEL = 0.45, 0.015
Array = np.ndarray


def _volume(*bodies: tuple[Array, float]) -> Volume:
    """A ball of REACH with bodies: where (N, N, N) they are, and their raw density."""
    grid = np.zeros((*_points().shape[:3], 4), np.float32)
    grid[..., 0] = -kernel.LIMIT
    for inside, density in bodies:
        grid[inside & (np.linalg.norm(_points(), axis=-1) <= REACH), 0] = density
    room = Room(np.zeros(3, np.float32), 1.0, REACH, PARAMS.room, PARAMS.environment)
    room.outer = True
    return Volume(grid, np.full(3, -REACH), VOXEL, 0.7, room, 0, 30.0, CameraFit.alike(1, PARAMS.cameras))


def _points() -> Array:
    axis = -REACH + VOXEL * np.arange(61)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)


def _ball(radius: float, *centre: float) -> Array:
    return np.linalg.norm(_points() - np.array(centre), axis=-1) < radius


def _solid(volume: Volume) -> Array:
    return np.logaddexp(0, volume.grid[..., 0]) > PARAMS.volume.body_depth


def test_the_body_at_the_common_centre_wins_over_a_heavier_one() -> None:
    head, wardrobe = _ball(0.1, 0.0, 0.0, 0.0), _ball(0.16, -0.1, 0.32, 0.0)
    volume = _volume((head, 2.0), (wardrobe, 4.0))
    kept = _solid(subject_of(volume, (), PARAMS))
    assert kept[head].all() and not kept[wardrobe].any()


def test_a_wall_that_the_subject_hangs_on_is_left_to_the_room() -> None:
    head, wall = _ball(0.2, 0.12, 0.0, 0.0), np.abs(_points()[..., 0] + 0.06) < 0.02
    volume = _volume((head, 5.0), (wall, 5.0))
    found = Wall(np.array([1.0, 0.0, 0.0]), -0.04)
    subject = subject_of(volume, (found,), PARAMS)
    before = found.height(_points()) >= PARAMS.subject.walls.margin
    np.testing.assert_array_equal(_solid(subject), head & before)
    assert subject.removed is not None
    rest = np.logaddexp(0, subject.removed[..., 0]) > PARAMS.volume.body_depth
    np.testing.assert_array_equal(rest, _solid(volume) & ~(head & before))


def test_smooth_pale_surfaces_stay_where_they_are_faint() -> None:
    """A plaster head's chin has an optical depth of 0.05 a voxel."""
    head, chin = _ball(0.2, 0.0, 0.0, 0.1), _ball(0.1, 0.1, 0.0, -0.1)
    volume = _volume((chin, float(np.log(np.expm1(0.05)))), (head, 5.0))
    kept = subject_of(volume, (), PARAMS).grid[..., 0] > -10
    assert kept[chin].all()


def test_shoulders_and_what_hangs_free_stay_whole() -> None:
    chest = (np.abs(_points()[..., 0]) < 0.1) & (np.abs(_points()[..., 1]) < 0.2) & (_points()[..., 2] < -0.1)
    volume = _volume((_ball(0.2, 0.0, 0.0, 0.0), 5.0), (chest, 5.0))
    np.testing.assert_array_equal(_solid(subject_of(volume, (), PARAMS)), _solid(volume))
    assert cut_share(volume, (), PARAMS) == 0


def test_ears_at_the_edge_of_the_ball_are_noticed() -> None:
    ears = (np.abs(_points()[..., 0] - 0.15) < 0.05) & (np.abs(_points()[..., 1]) < 0.1) & (_points()[..., 2] > 0)
    volume = _volume((_ball(0.2, 0.0, 0.0, 0.0), 5.0), (ears, 5.0))
    assert cut_share(volume, (), PARAMS) > PARAMS.subject.max_cut


def test_a_solid_head_is_thin_and_a_foggy_one_thick() -> None:
    head = _ball(0.2, 0.0, 0.0, 0.0)
    solid, fog = _volume((head, 8.0)), _volume((head, float(np.log(np.expm1(0.1)))))
    assert thickness(solid, 0.5) < 2 * VOXEL
    # Of 1 - exp(-s / 0.15) a tenth is reached 0.015 deep, nine tenths 0.3 deep; most ways through the ball are shorter.
    assert 0.15 < thickness(fog, 0.5) < 0.25
    assert thickness(_volume(), 0.5) == 0


def test_fog_is_taken_to_be_denser_and_a_solid_head_is_left() -> None:
    head = _ball(0.2, 0.0, 0.0, 0.0)
    solid, fog = _volume((head, 8.0)), _volume((head, float(np.log(np.expm1(0.1)))))
    notes: list[Fact] = []
    assert clear_of_fog(solid, PARAMS, notes) is solid and not notes
    dense = clear_of_fog(fog, PARAMS, notes)
    assert [note.kind for note in notes] == ["fog"]
    ahead = np.zeros((1, 2))  # from the ball's centre
    middle, surface = (profile(v, Chart((0.0, 0.0, 0.0)), ahead, 0.3).radius[0] for v in (fog, dense))
    assert middle < surface - 0.03 and surface > 0.2 - 2 * VOXEL


def test_a_hole_in_fog_is_filled_and_a_wide_dent_is_not() -> None:
    """A head with a tunnel of 0.06 across, which the room was given, and a dent as wide as itself."""
    points, thin = _points(), float(np.log(np.expm1(0.1)))
    tunnel = np.hypot(points[..., 1], points[..., 2]) < 0.03
    dent = _ball(0.2, 0.0, 0.0, 0.3)
    head = _ball(0.2, 0.0, 0.0, 0.0) & ~dent
    volume = _volume((head & ~tunnel, thin))
    removed = volume.grid.copy()
    removed[..., 0] = np.where(tunnel, thin, EMPTY)
    found = filled(replace(volume, removed=removed), PARAMS)
    assert found.removed is not None
    inside = head & tunnel & _ball(0.17, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(found.grid[inside, 0], thin)
    assert (found.removed[inside, 0] == np.float32(EMPTY)).all()
    outside = ~_ball(0.22, 0.0, 0.0, 0.0)
    np.testing.assert_array_equal(found.grid[outside], volume.grid[outside])
    assert not _solid(found)[_ball(0.15, 0.0, 0.0, 0.3)].any()
    notes: list[Fact] = []
    dense = clear_of_fog(replace(volume, removed=removed), PARAMS, notes)
    assert [note.kind for note in notes] == ["fog"]
    np.testing.assert_array_equal(dense.grid, found.denser(PARAMS.start.fog_gain).grid)
    none = PARAMS.model_copy(update={"start": PARAMS.start.model_copy(update={"fog_holes": 0.0})})
    assert filled(volume, none) is volume
    least = filled(volume, PARAMS).grid[inside, 0]  # nothing was taken out there
    np.testing.assert_allclose(np.logaddexp(0, least), PARAMS.subject.body_depth, rtol=1e-5)


def test_closing_fills_what_a_ball_does_not_fit_into() -> None:
    wall = np.ones((20, 20, 9), bool)
    wall[8:11, 8:11] = False
    assert closing(wall, 2.0)[..., 2:-2].all() and not closing(wall, 1.0)[9, 9].any()
    assert not closing(np.zeros((4, 5, 6), bool), 3.0).any()
    np.testing.assert_array_equal(closing(wall, 0.0), wall)


def test_a_denser_volume_has_so_many_times_the_optical_depth() -> None:
    volume = _volume((_ball(0.2, 0.0, 0.0, 0.0), 1.5))
    before, after = (np.logaddexp(0, v.grid[..., 0].astype(float)) for v in (volume, volume.denser(7.0)))
    np.testing.assert_allclose(after, 7 * before, rtol=1e-5, atol=1e-9)


def test_nothing_solid_is_no_body() -> None:
    volume = _volume()
    assert not body_at_centre(volume, 0.15, 0.1).any()
    assert cut_share(volume, (), PARAMS) == 0
    assert positions(replace(volume, lower=np.zeros(3)))[0, 0, 0].tolist() == [0, 0, 0]


def test_faint_hair_stays_where_there_is_no_room_and_no_other_body() -> None:
    head, hair = _ball(0.1, 0.0, 0.0, 0.0), _ball(0.2, 0.0, 0.0, 0.0)
    volume = _volume((hair, -4.0), (head, 5.0))
    assert subject_of(volume, (), PARAMS).grid[30, 30, 42, 0] < -10
    volume.room.outer = False
    assert subject_of(volume, (), PARAMS).grid[30, 30, 42, 0] == -4.0


def test_a_given_ball_is_the_only_one_that_is_tried() -> None:
    params = in_ball(0.3, PARAMS)
    assert (params.volume.reach, params.subject.larger) == (0.3, ())
    assert in_ball(None, PARAMS) == PARAMS
