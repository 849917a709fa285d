"""Training rays, drawn uniformly over cameras, pixels and frames, straight from the memory-mapped frame store."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from facefolds_core.captures.scene import Scene
from facefolds_core.errors import UserError
from facefolds_core.model.intersection import search_interval


def nothing_seen(scene: Scene) -> UserError:
    return UserError(
        "no pixel of any training camera sees the subject",
        file=scene.folder / "scene.json",
        expected="cameras that look at the origin",
        remedy="check the capture's calibration, and `front` or the head poses",
    )


@dataclass(frozen=True)
class Rays:
    """A batch of R rays with their true colours.

    Attributes:
        origins, directions: [R, 3], directions of unit length.
        time: [R] frame indices (float).
        rgb: [R, 3] in [0, 1].
    """

    origins: Tensor
    directions: Tensor
    time: Tensor
    rgb: Tensor


class RaySampler:
    """Draws rays of the training cameras.

    Rays that miss the half ball in which surfaces are searched are never drawn: nothing that is learnt changes their
    colour, so their gradient is zero. (The paper does not say; it only shortens training.)

    Args:
        scene: whose training cameras are used.
        centre, radius: of the search ball.
        device: where batches go. Drawing itself is on the CPU, so that it repeats on any device.

    Raises:
        UserError: if the training cameras do not all have as many images, or no pixel of any camera meets the ball.
    """

    def __init__(self, scene: Scene, centre: Tensor, radius: float, device: torch.device) -> None:
        self.store = scene.open_frames()
        self.cameras = scene.indices("train")
        self.width = scene.width
        self.device = device
        self.frames = torch.from_numpy(self._frames_of_cameras(scene))
        pixels = []
        turns = range(1 if scene.poses is None else scene.num_frames)
        for camera in self.cameras:
            valid = torch.zeros(scene.height * scene.width, dtype=torch.bool)
            for frame in turns:
                rays = scene.camera_in_head(camera, frame).rays()
                origins, directions = (torch.from_numpy(a.reshape(-1, 3).copy()) for a in rays)
                valid |= search_interval(origins, directions, centre.cpu().to(origins.dtype), radius)[2]
            pixels.append(valid.nonzero().squeeze(1).to(torch.int32))
        self.pixels = torch.cat(pixels)
        self.ends = torch.tensor([len(p) for p in pixels]).cumsum(0)
        if len(self.pixels) == 0:
            raise nothing_seen(scene)
        # Pixel (x, y, 1) -> direction in the head's frame: R^T K^-1. Of a still head one camera serves all frames.
        self.turns = len(turns)
        views = [scene.camera_in_head(c, k) for c in self.cameras for k in turns]
        unproject = [view.rotation.T @ np.linalg.inv(view.K) for view in views]
        self.unproject = torch.tensor(np.stack(unproject), dtype=torch.float32, device=device)
        centres = np.stack([view.centre for view in views])
        self.centres = torch.tensor(centres, dtype=torch.float32, device=device)

    def draw(self, count: int, generator: torch.Generator) -> Rays:
        """`count` rays, drawn with replacement."""
        index = torch.randint(len(self.pixels), (count,), generator=generator)
        camera = torch.searchsorted(self.ends, index, right=True)
        turn = torch.randint(self.frames.shape[1], (count,), generator=generator)
        frame = self.frames[camera, turn]
        pixel = self.pixels[index].long()
        colours = self._colours(camera.numpy(), frame.numpy(), pixel.numpy())
        xy1 = torch.stack([pixel % self.width + 0.5, pixel // self.width + 0.5, torch.ones(count)], -1)
        cam = (camera * self.turns + frame % self.turns).to(self.device)
        directions = torch.einsum("rij,rj->ri", self.unproject[cam], xy1.to(self.device))
        return Rays(
            origins=self.centres[cam],
            directions=torch.nn.functional.normalize(directions, dim=-1),
            time=frame.to(self.device, torch.float32),
            rgb=torch.from_numpy(colours).to(self.device).float() / 255,
        )

    def _frames_of_cameras(self, scene: Scene) -> np.ndarray:
        """(cameras, M) int64: the frames that each training camera has, M of them."""
        frames: dict[int, list[int]] = {camera: [] for camera in self.cameras}
        for camera, frame in self.store:
            if camera in frames:
                frames[camera].append(frame)
        most = max(map(len, frames.values()), default=0)
        short = [f"camera {scene.cameras[c].name}" for c, found in frames.items() if len(found) < max(most, 1)]
        unseen = set(range(scene.num_frames)) - {frame for found in frames.values() for frame in found}
        missing = short + [f"frame {scene.frame_ids[frame]}" for frame in sorted(unseen)]
        if missing:
            raise UserError(
                "training images are missing",
                file=self.store.path,
                place=", ".join(missing),
                expected="as many images of every training camera, and every frame seen by one",
                remedy="run `dvc repro` to make the normalised scene again",
            )
        return np.array([frames[camera] for camera in self.cameras], np.int64)

    def _colours(self, camera: np.ndarray, frame: np.ndarray, pixel: np.ndarray) -> np.ndarray:
        """(R, 3) uint8; one look-up an image, because each is its own view of the mapped file."""
        frames = int(frame.max()) + 1
        key = camera * frames + frame
        order = np.argsort(key, kind="stable")
        images, starts = np.unique(key[order], return_index=True)
        colours = np.empty((len(key), 3), np.uint8)
        for image, rows in zip(images, np.split(order, starts[1:]), strict=True):
            view = self.store.image(self.cameras[image // frames], int(image % frames))
            colours[rows] = view.reshape(-1, 3)[pixel[rows]]
        return colours
