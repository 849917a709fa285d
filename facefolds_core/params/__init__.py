"""The sections of params.yaml and their keys: the only place that knows them, their units and their defaults.

`params_file.load_params` reads the file. Nothing below `stages/` reads a raw dictionary of parameters. What nobody
needs to change is a constant beside the code that uses it, with its reason.
"""

from facefolds_core.params.base import Section, merged
from facefolds_core.params.capture import CaptureParams, NormalizeParams, SubjectParams
from facefolds_core.params.compress import (
    AttentionParams,
    CodecName,
    CompressParams,
    LevelParams,
    MeshCodec,
    StreamParams,
    VideoCodec,
)
from facefolds_core.params.evaluate import EvaluateParams
from facefolds_core.params.explicit import ExplicitParams, GeometryParams, ReflectionParams, StartParams
from facefolds_core.params.export import (
    BakeParams,
    DecimateParams,
    ReconstructParams,
    SampleParams,
    TextureParams,
)
from facefolds_core.params.mlp import MlpParams
from facefolds_core.params.sections import SECTIONS, STAGE_SECTIONS, section_of, train_params, user_error
from facefolds_core.params.subject import FrameRange, HoldoutEvery, Overrides, Subject
from facefolds_core.params.train import PRESETS, Preset, TrainParams, TrainSection

__all__ = [
    "PRESETS",
    "SECTIONS",
    "STAGE_SECTIONS",
    "AttentionParams",
    "BakeParams",
    "CaptureParams",
    "CodecName",
    "CompressParams",
    "DecimateParams",
    "EvaluateParams",
    "ExplicitParams",
    "FrameRange",
    "GeometryParams",
    "HoldoutEvery",
    "LevelParams",
    "MeshCodec",
    "MlpParams",
    "NormalizeParams",
    "Overrides",
    "Preset",
    "ReconstructParams",
    "ReflectionParams",
    "SampleParams",
    "Section",
    "StartParams",
    "StreamParams",
    "Subject",
    "SubjectParams",
    "TextureParams",
    "TrainParams",
    "TrainSection",
    "VideoCodec",
    "merged",
    "section_of",
    "train_params",
    "user_error",
]
