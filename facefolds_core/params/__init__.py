"""The sections of params.yaml and their keys: the only place that knows them, their units and their defaults.

`params_file.load_params` reads the file. Nothing below `stages/` reads a raw dictionary of parameters. What nobody
needs to change is a constant beside the code that uses it, with its reason.
"""

from facefolds_core.params.base import Section, merged, nested, value_at
from facefolds_core.params.capture import CaptureParams, NormalizeParams
from facefolds_core.params.compress import (
    AttentionParams,
    CodecName,
    CompressParams,
    GlbParams,
    LevelParams,
    MeshCodec,
    StreamParams,
    VideoCodec,
)
from facefolds_core.params.evaluate import EvaluateParams, ScoreWarningParams
from facefolds_core.params.explicit import (
    DivergenceParams,
    ExplicitParams,
    FollowParams,
    GridTextureParams,
    MovingParams,
)
from facefolds_core.params.export import (
    BakeParams,
    DecimateParams,
    ReconstructParams,
    SampleParams,
    TextureParams,
)
from facefolds_core.params.matte import CutOutParams, MatteParams, OutlineParams, PlateParams, VoteParams
from facefolds_core.params.mlp import MlpParams
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
    "BakeParams",
    "CameraParams",
    "CaptureParams",
    "CodecName",
    "CompressParams",
    "CutOutParams",
    "DecimateParams",
    "DivergenceParams",
    "EnvironmentParams",
    "EvaluateParams",
    "ExplicitParams",
    "FollowParams",
    "FrameRange",
    "GeometryParams",
    "GlbParams",
    "GridTextureParams",
    "HoldoutEvery",
    "LevelParams",
    "MatteParams",
    "MeshCodec",
    "MeshParams",
    "MlpParams",
    "MovingParams",
    "NormalizeParams",
    "OutlineParams",
    "Overrides",
    "PlateParams",
    "Preset",
    "PruningParams",
    "ReconstructParams",
    "ReflectionParams",
    "RoomParams",
    "SampleParams",
    "ScoreWarningParams",
    "Section",
    "SegmentParams",
    "StartParams",
    "StreamParams",
    "Subject",
    "SubjectParams",
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
