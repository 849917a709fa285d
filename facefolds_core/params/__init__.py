"""The sections of params.yaml and their keys: the only place that knows them, their units and their defaults.

`params_file.load_params` reads the file. Nothing below `stages/` reads a raw dictionary of parameters, and no function
below takes a number that somebody might tune from anywhere but a section (tests/core/test_constants.py).
"""

from facefolds_core.params.base import Section, merged, nested, value_at
from facefolds_core.params.capture import CaptureParams, MotionParams, NormalizeParams, RegistrationParams
from facefolds_core.params.choice import ChoiceParams, MeshChoiceParams, TextureChoiceParams
from facefolds_core.params.compress import (
    AttentionParams,
    BetweenParams,
    CodecName,
    CompressParams,
    CrfSearchParams,
    GlbParams,
    LevelParams,
    MeshCodec,
    MeterParams,
    StreamParams,
    VideoCodec,
)
from facefolds_core.params.evaluate import EvaluateParams, ScoreWarningParams
from facefolds_core.params.explicit import (
    BackgroundParams,
    DivergenceParams,
    ExplicitParams,
    FollowParams,
    GridTextureParams,
    LossParams,
    MovingParams,
)
from facefolds_core.params.export import (
    AutoWindowParams,
    BakeParams,
    CollapseParams,
    DecimateParams,
    ReconstructParams,
    RefitParams,
    SampleParams,
    TextureParams,
)
from facefolds_core.params.few_cameras import FewCameraParams
from facefolds_core.params.matte import CutOutParams, MatteParams, OutlineParams, PlateParams, VoteParams
from facefolds_core.params.mlp import MlpParams, MlpStartParams
from facefolds_core.params.pruning import PruningParams
from facefolds_core.params.reflection import ReflectionParams
from facefolds_core.params.sections import SECTIONS, STAGE_SECTIONS, section_of, train_params, user_error
from facefolds_core.params.segments import SegmentParams
from facefolds_core.params.subject import FrameRange, HoldoutEvery, Overrides, Subject
from facefolds_core.params.surfaces import GeometryParams, MeshParams, StartParams
from facefolds_core.params.train import PRESETS, Preset, TrainParams, TrainSection
from facefolds_core.params.volume import (
    CameraParams,
    EnvironmentParams,
    RoomParams,
    SubjectParams,
    VolumeLevel,
    VolumeParams,
    WallParams,
    WarningParams,
)

__all__ = [
    "PRESETS",
    "SECTIONS",
    "STAGE_SECTIONS",
    "AttentionParams",
    "AutoWindowParams",
    "BackgroundParams",
    "BakeParams",
    "BetweenParams",
    "CameraParams",
    "CaptureParams",
    "ChoiceParams",
    "CodecName",
    "CollapseParams",
    "CompressParams",
    "CrfSearchParams",
    "CutOutParams",
    "DecimateParams",
    "DivergenceParams",
    "EnvironmentParams",
    "EvaluateParams",
    "ExplicitParams",
    "FewCameraParams",
    "FollowParams",
    "FrameRange",
    "GeometryParams",
    "GlbParams",
    "GridTextureParams",
    "HoldoutEvery",
    "LevelParams",
    "LossParams",
    "MatteParams",
    "MeshChoiceParams",
    "MeshCodec",
    "MeshParams",
    "MeterParams",
    "MlpParams",
    "MlpStartParams",
    "MotionParams",
    "MovingParams",
    "NormalizeParams",
    "OutlineParams",
    "Overrides",
    "PlateParams",
    "Preset",
    "PruningParams",
    "ReconstructParams",
    "RefitParams",
    "ReflectionParams",
    "RegistrationParams",
    "RoomParams",
    "SampleParams",
    "ScoreWarningParams",
    "Section",
    "SegmentParams",
    "StartParams",
    "StreamParams",
    "Subject",
    "SubjectParams",
    "TextureChoiceParams",
    "TextureParams",
    "TrainParams",
    "TrainSection",
    "VideoCodec",
    "VolumeLevel",
    "VolumeParams",
    "VoteParams",
    "WallParams",
    "WarningParams",
    "merged",
    "nested",
    "section_of",
    "train_params",
    "user_error",
    "value_at",
]
