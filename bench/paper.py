"""The paper's published points: its tables as they stand there (FaceFolds, comparisons and ablations).

Its data are Multiface subjects at 768 x 500, 60 frames, two held-out cameras each, whole frame, LPIPS;
MB and KB as it writes them.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperPoint:
    """One row of an ablation.

    Attributes:
        value: number of manifolds, R^m or R^t.
        lpips: LPIPS, not ST-LPIPS.
        disk: as printed.
        disk_bytes: the same in bytes.
    """

    value: int
    psnr: float
    ssim: float
    lpips: float
    triangles: int
    disk: str

    @property
    def disk_bytes(self) -> float:
        number, unit = self.disk.split()
        return float(number) * {"MB": 1e6, "KB": 1e3}[unit]


MESH_DISK = 118.1e6
"""Bytes of the meshes in the ablation on texture resolution."""
TEXTURE_DISK = 5.9e6
"""Bytes of the video in the ablation on mesh resolution."""

PAPER: dict[str, tuple[PaperPoint, ...]] = {
    "layers": (
        PaperPoint(12, 25.54, 0.760, 0.341, 6264412, "125.1 MB"),
        PaperPoint(4, 24.47, 0.728, 0.372, 2088497, "42.9 MB"),
        PaperPoint(1, 22.51, 0.704, 0.395, 522242, "11.0 MB"),
    ),
    "mesh": (
        PaperPoint(512, 30.10, 0.858, 0.284, 6261920, "118.1 MB"),
        PaperPoint(256, 29.58, 0.838, 0.293, 1377119, "22.2 MB"),
        PaperPoint(128, 29.57, 0.839, 0.290, 250740, "4.1 MB"),
        PaperPoint(64, 29.49, 0.837, 0.289, 43224, "721 KB"),
        PaperPoint(32, 29.12, 0.831, 0.291, 9962, "170 KB"),
        PaperPoint(16, 27.26, 0.795, 0.306, 2574, "38 KB"),
        PaperPoint(8, 23.81, 0.705, 0.364, 728, "11 KB"),
    ),
    "texture": (
        PaperPoint(1024, 30.10, 0.858, 0.284, 6261920, "5.9 MB"),
        PaperPoint(512, 30.29, 0.859, 0.303, 6261920, "2.1 MB"),
        PaperPoint(256, 29.51, 0.836, 0.341, 6261920, "667 KB"),
        PaperPoint(128, 27.32, 0.791, 0.404, 6261920, "183 KB"),
    ),
}
"""Ablations: number of manifolds (disk: meshes and video; 240 images of two subjects); R^m (disk: meshes) and R^t
(disk: video), 120 images of subject 002914589."""


def total_bytes(sweep: str, point: PaperPoint) -> float:
    """Meshes and video together."""
    return point.disk_bytes + {"layers": 0.0, "mesh": TEXTURE_DISK, "texture": MESH_DISK}[sweep]
