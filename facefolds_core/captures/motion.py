"""How a capture's head moves as a whole, and whether that is so much that its model is made in the head's own frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from facefolds_core.captures.capture import Capture, Tracking
from facefolds_core.errors import UserError
from facefolds_core.facts import Fact, fact
from facefolds_core.geometry.similarity import Array, Similarity
from facefolds_core.geometry.track import Track, own_track, rigid_motion
from facefolds_core.params import NormalizeParams
from facefolds_core.system.spill import by_rows, running_mean

MUCH_TURN = 2.0
"""`stabilize: auto` stabilises where the head turns by more in any frame, against its mean pose, degrees."""

MUCH_SHIFT = 0.02
"""It does so, too, where the head shifts by more, as a share of the tracked mesh's largest extent."""


def head_motion(
    capture: Capture, frames: Sequence[int], similarity: Similarity, params: NormalizeParams
) -> tuple[Track | None, list[Fact]]:
    """The track that `normalize.stabilize` asks for, and what is to be said of it.

    Args:
        frames: indices in the capture of those in use.
        similarity: capture -> normalised coordinates.

    Returns:
        the head's own frame -> world in each of these frames, normalised; None where the head is taken to stand still.
    """
    tracking = capture.tracking
    if tracking is None and params.stabilize is True:
        raise UserError(
            "there are no head poses to stabilise by",
            file=capture.root,
            expected="tracked_mesh/SEGMENT/FRAME_transform.txt",
            remedy="set `stabilize: found` in `normalize` for this subject, which looks for them in the pictures",
        )
    if tracking is None or params.stabilize == "found":
        return None, []
    rotations, translations, source = _poses(tracking, frames)
    world = tracking.world_vertices(frames)
    vertices = by_rows(len(world), lambda rows: similarity.apply(world[rows]))
    moves = zip(rotations, translations, strict=True)
    poses = [similarity.after(Similarity(1.0, R, t)).after(similarity.inverse()) for R, t in moves]
    track = own_track(poses, middles(vertices))
    size = float(np.ptp(vertices, axis=1).max(1).mean())
    found = {"degrees": float(track.degrees().max()), "shift": _shift(track, vertices) / max(size, 1e-12)}
    much = is_much(**found)
    if params.stabilize is False or len(frames) < 2:
        return None, [fact("head_turns_unheeded", **found)] if much else []
    if params.stabilize is True or much:
        return track, [fact("head_turns", **found, source=source)]
    return None, []


def is_much(degrees: float, shift: float) -> bool:
    """Whether a head that turns and shifts so far does not stand still."""
    return degrees > MUCH_TURN or shift > MUCH_SHIFT


def in_head(vertices: Array, track: Track | None, first: int) -> Array:
    """Vertices (K, V, 3) of the world in frames `first` on, in the head's own frame."""
    if track is None:
        return vertices
    return np.stack([track.at(k).inverse().apply(points) for k, points in enumerate(vertices, first)])


def _poses(tracking: Tracking, frames: Sequence[int]) -> tuple[Array, Array, str]:
    """Rotations (K, 3, 3), translations (K, 3) of something that moves with the head -> world, and where from.

    Poses that are all alike say nothing: then the meshes are laid over their mean shape.
    """
    poses = tracking.poses[list(frames)]
    if np.abs(poses - poses[0]).max() > 1e-9 * max(1.0, float(np.abs(poses).max())):
        return poses[:, :, :3], poses[:, :, 3], "the capture's poses"
    vertices = tracking.world_vertices(frames)
    shape, motions = vertices[0], []
    for _ in range(3):
        motions = [rigid_motion(shape, points) for points in vertices]
        shape = running_mean((points - t) @ R for points, (R, t) in zip(vertices, motions, strict=True))
    return np.array([R for R, _ in motions]), np.array([t for _, t in motions]), "laid over the tracked meshes"


def middles(vertices: Array) -> Array:
    """(K, 3) of the bounding boxes of vertices (K, V, 3)."""
    return np.asarray((vertices.min(1) + vertices.max(1)) / 2)


def _shift(track: Track, vertices: Array) -> float:
    """How far the head's middle goes from where it is on average, units."""
    middle = middles(vertices).mean(0)
    return max(float(np.linalg.norm(track.at(k).apply(middle) - middle)) for k in range(len(track)))
