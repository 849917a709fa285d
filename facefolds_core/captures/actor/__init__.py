"""The embedded actor: a procedural talking head with everything that a capture has, and the truth behind it.

Its renderer is written from nothing (distance functions, sphere tracing, ray-marched hair) and shares no code with the
product's rendering, so that one can judge the other. docs/guide/actor.md describes it.
"""

from facefolds_core.captures.actor.capture import SEGMENT, frame_times, write_capture
from facefolds_core.captures.actor.mesh import tracked_mesh
from facefolds_core.captures.actor.motion import head_pose
from facefolds_core.captures.actor.render import ActorOptions, ActorPicture, render
from facefolds_core.captures.actor.rig import ActorRig, camera_at, make_rig

__all__ = [
    "SEGMENT",
    "ActorOptions",
    "ActorPicture",
    "ActorRig",
    "camera_at",
    "frame_times",
    "head_pose",
    "make_rig",
    "render",
    "tracked_mesh",
    "write_capture",
]
