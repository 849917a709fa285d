"""The yardstick of the layouts' tests: the filmed actor comes back whole from its own layout, and errors are seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facefolds_core.captures.actor.capture import krt_block
from facefolds_core.captures.scene import Scene
from tests.filmed import check_same, film, save_pictures, scene_of


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The film as a Multiface capture without mesh."""
    root, truth = tmp_path_factory.mktemp("multiface"), film()
    (root / "KRT").write_text("".join(krt_block(camera) for camera in truth.cameras))
    save_pictures(root / "images" / "S", truth.names, truth.images)
    save_pictures(root / "masks" / "S", truth.names, truth.mattes)
    return scene_of(root, "multiface", root / "scene", truth.names)


def test_multiface_brings_the_film_back(scene: Scene) -> None:
    check_same(scene, film(), mattes="held")


@pytest.mark.parametrize("what", ["pose", "K", "pixels", "mattes", "names"])
def test_what_is_wrong_is_seen(scene: Scene, what: str) -> None:
    truth = film()
    first = truth.cameras[0]
    if what == "pose":
        moved = replace(first, w2c=first.w2c + np.array([[0, 0, 0, 0.01]] * 3))
        truth = replace(truth, cameras=(moved, *truth.cameras[1:]))
    elif what == "K":
        truth = replace(truth, cameras=(replace(first, K=first.K + np.eye(3) * [1e-3, 0, 0]), *truth.cameras[1:]))
    elif what == "pixels":
        truth = replace(truth, images=truth.images[:, ::-1])
    elif what == "mattes":
        truth = replace(truth, mattes=255 - truth.mattes)
    names = {name: truth.names[1 - c] if c < 2 else name for c, name in enumerate(truth.names)}
    with pytest.raises(AssertionError):
        check_same(scene, truth, names if what == "names" else None, mattes="held")


def test_a_loss_of_a_grey_level_is_within_the_limit_for_videos(scene: Scene) -> None:
    truth = film()
    near = np.where(truth.images > 0, truth.images - 1, 0).astype(np.uint8)
    check_same(scene, replace(truth, images=near), lossless=False)
    with pytest.raises(AssertionError, match="dB"):
        check_same(scene, replace(truth, images=truth.images // 2), lossless=False)
