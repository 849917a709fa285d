"""Heads that turn: poses from transforms and meshes, and how much motion is stabilised."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from facefolds_core.captures.assembly import Plan
from facefolds_core.params import NormalizeParams
from tests.captures.fixtures import HEAD, HEAD_TO_WORLD, VERTICES, head_pose, plan_of, pose_text, write_multiface


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Plan]:
    """Of a head that turns by 0, 10, 20 degrees: not stabilised, and stabilised."""
    root = tmp_path_factory.mktemp("turning") / "c"
    write_multiface(root, turn=10)
    still, turned = (plan_of(root, NormalizeParams(stabilize=wanted)) for wanted in (False, True))
    return still, turned


def test_a_stabilised_head_stands_still_in_its_mean_pose(plans: tuple[Plan, Plan]) -> None:
    """The mean is the second frame, whose vertices stay where they were in the world."""
    still, turned = plans
    assert np.abs(turned.vertices - turned.vertices[:1]).max() < 1e-6
    assert turned.scene.poses.degrees() == pytest.approx([10, 0, 10], abs=1e-6)
    assert np.abs(still.vertices[1] - turned.vertices[1]).max() < 2e-3  # of 0.3: turns shorten the mean, the box


def test_a_stabilised_scene_has_the_cameras_and_views_of_an_unstabilised_one(plans: tuple[Plan, Plan]) -> None:
    """So that scores compare."""
    still, turned = plans
    assert still.scene.poses is None and turned.scene.poses is not None
    assert (still.scene.splits, still.rows) == (turned.scene.splits, turned.rows)
    for a, b in zip(still.scene.cameras, turned.scene.cameras, strict=True):
        assert (a.name, a.w2c.tolist()) == (b.name, b.w2c.tolist())


@pytest.mark.parametrize(
    ("turn", "stabilize", "kinds"),
    [
        (0.5, "auto", []),
        (10, "auto", ["head_turns"]),
        (0.5, True, ["head_turns"]),
        (10, False, ["head_turns_unheeded"]),
    ],
)
def test_how_much_motion_is_stabilised(tmp_path: Path, turn: float, stabilize: Any, kinds: list[str]) -> None:
    write_multiface(tmp_path / "c", turn=turn)
    scene = plan_of(tmp_path / "c", NormalizeParams(stabilize=stabilize)).scene
    found = [one.kind for one in scene.left_out if one.kind.startswith("head_")]
    assert (found, scene.poses is not None) == (kinds, kinds == ["head_turns"])


def test_meshes_that_stand_in_the_world_tell_the_poses(tmp_path: Path) -> None:
    """All transforms alike: the mesh itself turns, and a corner of it, a jaw, moves."""
    made = write_multiface(tmp_path / "c")
    for k, frame in enumerate(made.frames):
        turned, (rotation, _) = HEAD_TO_WORLD @ head_pose(k, 10)[0], head_pose(0)
        vertices = np.concatenate([VERTICES, 0.5 * VERTICES, VERTICES * [0.7, 0.2, 0.4]]) @ turned.T
        vertices[0] += [0, 2.0 * k, 0]
        made.mesh(frame, ".obj").unlink()
        vertices.astype("<f4").tofile(made.mesh(frame, ".bin"))
        made.mesh(frame, "_transform.txt").write_text(pose_text(rotation, HEAD))
    scene = plan_of(tmp_path / "c").scene
    assert scene.poses.degrees() == pytest.approx([10, 0, 10], abs=0.3)
