"""The head's poses as a file beside the manifest: ten minutes of them are half a megabyte, and 4.3 MB as JSON.

The players read the same bytes (viewer/src/track.js, engines/).
`track.bin` has for each frame 7 little-endian float32: the quaternion w, x, y, z, and the translation.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from facefolds_core.asset.manifest import REMEDY, Manifest
from facefolds_core.asset.manifest_base import FARTHEST, StoredFile
from facefolds_core.asset.stored import read_slice
from facefolds_core.errors import UserError
from facefolds_core.geometry.track import Track

TRACK_NAME = "track.bin"
NUMBERS = 7
"""In a pose."""
POSE_BYTES = 4 * NUMBERS
LEAST_BAND = 1e-6
"""Of a torso, units: thinner is no band."""


def write_track(folder: Path, track: Track) -> StoredFile:
    """Write the poses; returns the manifest's entry."""
    data = np.concatenate([track.quaternions, track.translations], 1).astype("<f4").tobytes()
    (folder / TRACK_NAME).write_bytes(data)
    return StoredFile(file=TRACK_NAME, bytes=len(data), sha256=hashlib.sha256(data).hexdigest())


def read_track(folder: Path, manifest: Manifest) -> Track | None:
    """The poses of an asset in `folder`; None where the head stands still.

    Raises:
        UserError: if the file is not the manifest's, or holds no poses.
    """
    entry = manifest.track_file
    if entry is None:
        return None
    path = folder / entry.file
    data = read_slice(path, 0, entry.bytes, entry.sha256)
    problems = track_problems(manifest, data)
    if problems:
        raise UserError("damaged track", file=path, found="; ".join(problems), remedy=REMEDY)
    torso = None if manifest.torso is None else manifest.torso.torso()
    return replace(_unpacked(data), torso=torso)


def track_problems(manifest: Manifest, data: bytes | None = None) -> list[str]:
    """What is wrong with the poses, in words.

    Args:
        data: of the track's file; without it only what the manifest says is looked at.
    """
    frames, entry = manifest.full.texture.frames, manifest.track_file
    torso = manifest.torso
    if torso is not None:
        far = max(map(abs, (torso.offset, torso.band, *torso.translation)))
        if entry is None or not torso.torso().sound or torso.band < LEAST_BAND or far > FARTHEST:
            limits = f"a band of at least {LEAST_BAND:g}, nothing beyond {FARTHEST:g}"
            return [f"a torso needs poses, a normal and a quaternion of unit length, {limits}"]
    if entry is not None and entry.bytes != POSE_BYTES * frames:
        return [f"{entry.bytes} bytes are no poses of {POSE_BYTES} for {frames} frames"]
    if data is None:
        return []
    track = _unpacked(data)
    problems = track.problems(frames)
    if not problems and np.abs(track.translations).max() > FARTHEST:
        problems.append(f"the head is more than {FARTHEST:g} units away")
    return problems


def _unpacked(data: bytes) -> Track:
    numbers = np.frombuffer(data, "<f4").reshape(-1, NUMBERS).astype(float)
    return Track(numbers[:, :4].copy(), numbers[:, 4:].copy())
