"""What a level's encoders are told: the section as it is configured, and what follows from the meshes."""

from __future__ import annotations

import pytest

from facefolds_core.packaging.settings import fitted, level_params, needed
from facefolds_core.params import CompressParams, LevelParams, MeshCodec, VideoCodec
from tests.assets import cap_crops
from tests.scenes import look_at_origin

PARAMS = CompressParams(
    mesh=MeshCodec(max_error_pixels=0.1, quantization_bits=11, texture_coordinate_bits=9, compression_level=3),
    video=VideoCodec(crf=20, target_psnr=40.0, keyframe_interval=12),
)
COARSE = LevelParams(name="small", mesh_resolution=16, texture_resolution=64, crf=31)


def test_the_full_level_is_coded_as_configured() -> None:
    found = level_params(PARAMS)
    assert (found.mesh, found.video) == (PARAMS.mesh, PARAMS.video)


def test_a_coarser_level_has_a_rate_and_an_error_of_its_own() -> None:
    found = level_params(PARAMS, COARSE)
    assert (found.video.crf, found.video.target_psnr) == (31, None)
    assert (found.video.keyframe_interval, found.mesh.max_error_pixels, found.mesh.compression_level) == (12, 0.1, 3)
    assert level_params(PARAMS, COARSE.model_copy(update={"max_error_pixels": 0.5})).mesh.max_error_pixels == 0.5


def test_a_stream_has_one_key_frame_a_segment() -> None:
    assert level_params(PARAMS, interval=60).video.keyframe_interval == 60
    assert level_params(PARAMS, COARSE, 60).video.keyframe_interval == 60


def test_bits_of_a_mesh_follow_from_the_error_that_is_allowed() -> None:
    layers, cameras = cap_crops(2, 1, 32), [look_at_origin("a", 0.0, 0.0, 64)]
    asked = level_params(PARAMS)
    fine, coarse = (
        fitted(level_params(PARAMS, COARSE.model_copy(update={"max_error_pixels": error})), layers, cameras)
        for error in (0.05, 0.4)
    )
    assert coarse.mesh.quantization_bits < fine.mesh.quantization_bits <= 20
    assert coarse.mesh.compression_level == 3
    assert fitted(asked, layers, []) == asked  # nobody sees it
    exact = level_params(PARAMS.model_copy(update={"mesh": MeshCodec(max_error_pixels=None, quantization_bits=11)}))
    assert fitted(exact, layers, cameras) == exact


@pytest.mark.parametrize("explained, target", [(35.0, 43.0), (27.04, 37.0), (20.0, 36.0), (None, 43.0)])
def test_video_is_no_finer_than_the_models_error_asks_for(explained: float | None, target: float) -> None:
    asked = PARAMS.model_copy(update={"video": PARAMS.video.model_copy(update={"target_psnr": 43.0})})
    assert needed(asked, explained).video.target_psnr == target
    low = asked.model_copy(update={"video": asked.video.model_copy(update={"target_psnr": 30.0})})
    assert needed(low, explained).video.target_psnr == 30.0
    constant = asked.model_copy(update={"video": asked.video.model_copy(update={"target_psnr": None})})
    assert needed(constant, explained) is constant
