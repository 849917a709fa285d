"""LPIPS and ST-LPIPS: distances of deep features, in our own modules; only the published weights are read, from files.

- LPIPS (Zhang et al. 2018, version 0.1, AlexNet): trunk weights from torch hub's cache, where torchvision puts them;
  linear weights from the package torchmetrics. Without the trunk's file there is no LPIPS.
- ST-LPIPS (Ghildyal and Liu 2022, shift-tolerant AlexNet): all weights from the package stlpips-pytorch, an extra: it
  says BSD, but files in it say CC BY-NC-SA 4.0. It is another metric with other values, and is never reported as LPIPS.

No package is imported for its weights (both would import torchvision); nothing is downloaded.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor, nn

TRUNK_NAME = "alexnet-owt-7be5be79.pth"
"""torchvision's AlexNet; the digits are the first of its SHA-256."""
LPIPS_LINEAR = ("torchmetrics", "functional/image/lpips_models/alex.pth")
ST_LPIPS = ("stlpips_pytorch", "weights/vST0.0/alex_shift_tolerant.pth")

MIN_SIDE = 64
"""Pixels; smaller images are enlarged. The trunks see nothing useful below, and ST-LPIPS cannot run below 21."""

_SHIFT = (-0.030, -0.088, -0.188)
_SCALE = (0.458, 0.448, 0.450)


class BlurDown(nn.Module):
    """Binomial 3 x 3 blur at stride 2, on the input reflected by 2 pixels (Zhang 2019, padded more in ST-LPIPS)."""

    kernel: Tensor

    def __init__(self, channels: int) -> None:
        super().__init__()
        row = torch.tensor([1.0, 2.0, 1.0]) / 4
        self.register_buffer("kernel", (row[:, None] * row).expand(channels, 1, 3, 3).clone(), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        return nn.functional.conv2d(
            nn.functional.pad(x, (2, 2, 2, 2), mode="reflect"), self.kernel, stride=2, groups=x.shape[1]
        )


def _alexnet_stages() -> list[nn.Sequential]:
    """AlexNet's five convolutions, each up to its ReLU."""
    return [
        nn.Sequential(nn.Conv2d(3, 64, 11, stride=4, padding=2), nn.ReLU()),
        nn.Sequential(nn.MaxPool2d(3, 2), nn.Conv2d(64, 192, 5, padding=2), nn.ReLU()),
        nn.Sequential(nn.MaxPool2d(3, 2), nn.Conv2d(192, 384, 3, padding=1), nn.ReLU()),
        nn.Sequential(nn.Conv2d(384, 256, 3, padding=1), nn.ReLU()),
        nn.Sequential(nn.Conv2d(256, 256, 3, padding=1), nn.ReLU()),
    ]


def _shift_tolerant_stages() -> list[nn.Sequential]:
    """The same with stride 1 followed by a blur in place of every stride (Ghildyal and Liu 2022, section 4)."""
    return [
        nn.Sequential(nn.Conv2d(3, 64, 11, padding=2), BlurDown(64), nn.ReLU()),
        nn.Sequential(nn.MaxPool2d(3, 1), BlurDown(64), nn.Conv2d(64, 192, 5, padding=2), nn.ReLU()),
        nn.Sequential(nn.MaxPool2d(3, 1), BlurDown(192), nn.Conv2d(192, 384, 3, padding=1), nn.ReLU()),
        nn.Sequential(nn.Conv2d(384, 256, 3, padding=1), nn.ReLU()),
        nn.Sequential(nn.Conv2d(256, 256, 3, padding=1), nn.ReLU()),
    ]


class PerceptualDistance(nn.Module):
    """sum over stages of the mean over pixels of w . (f(a) - f(b))^2, f unit vectors of features at each pixel.

    Args:
        stages: five parts of the trunk, in order.
        convolutions: weight and bias of each stage's convolution.
        linear: w of each stage, [1, C, 1, 1].
    """

    shift: Tensor
    scale: Tensor

    def __init__(
        self, stages: list[nn.Sequential], convolutions: list[tuple[Tensor, Tensor]], linear: list[Tensor]
    ) -> None:
        super().__init__()
        self.stages = nn.ModuleList(stages)
        for stage, (weight, bias) in zip(stages, convolutions, strict=True):
            convolution = next(m for m in stage if isinstance(m, nn.Conv2d))
            convolution.load_state_dict({"weight": weight, "bias": bias})
        for i, w in enumerate(linear):
            self.register_buffer(f"linear{i}", w)
        self.register_buffer("shift", torch.tensor(_SHIFT)[:, None, None])
        self.register_buffer("scale", torch.tensor(_SCALE)[:, None, None])
        self.requires_grad_(False).eval()

    def features(self, images: Tensor) -> list[Tensor]:
        """Unit features of each stage; images [B, 3, H, W] in [0, 1]."""
        x = (2 * _enlarged(images) - 1 - self.shift) / self.scale
        found = []
        for stage in self.stages:
            x = stage(x)
            found.append(x / ((x**2).sum(1, keepdim=True).sqrt() + 1e-10))
        return found

    @torch.no_grad()
    def forward(self, images: Tensor, truth: Tensor) -> Tensor:
        """Distances [B] of images [B, 3, H, W] from one truth [3, H, W], all in [0, 1]."""
        total = torch.zeros(len(images), device=images.device)
        # One image at a time: the first stage of ST-LPIPS holds 64 channels at full resolution.
        reference = self.features(truth[None])
        for b, image in enumerate(images):
            for i, (f, g) in enumerate(zip(self.features(image[None]), reference, strict=True)):
                total[b] += ((f - g) ** 2 * self.get_buffer(f"linear{i}")).sum(1).mean()
        return total


def _enlarged(images: Tensor) -> Tensor:
    """Images whose short side is below MIN_SIDE, bilinearly enlarged (aspect kept) so that it is MIN_SIDE."""
    height, width = images.shape[-2:]
    short = min(height, width)
    if short >= MIN_SIDE:
        return images
    size = (round(height * MIN_SIDE / short), round(width * MIN_SIDE / short))
    return nn.functional.interpolate(images, size=size, mode="bilinear", align_corners=False)


@dataclass(frozen=True)
class Perceptual:
    """The perceptual metrics that this machine's files allow; `missing` says in words what was not found."""

    lpips: PerceptualDistance | None = None
    st_lpips: PerceptualDistance | None = None
    missing: tuple[str, ...] = ()


def find_perceptual(device: torch.device | str = "cpu") -> Perceptual:
    """Load what is on this machine. Nothing is downloaded."""
    lpips, st_lpips = load_lpips(), load_st_lpips()
    missing = []
    if lpips is None:
        missing.append(
            f"LPIPS was not measured: AlexNet's weights, {TRUNK_NAME}, are not in {_hub_folder()} (or are damaged); "
            "where torchvision is installed, torchvision.models.alexnet(weights='DEFAULT') puts them there"
        )
    if st_lpips is None:
        missing.append(
            "ST-LPIPS was not measured: pip install 'facefolds[perceptual]' (parts of that package are CC BY-NC-SA: "
            "not for commercial use)"
        )
    return Perceptual(
        None if lpips is None else lpips.to(device),
        None if st_lpips is None else st_lpips.to(device),
        tuple(missing),
    )


def load_lpips() -> PerceptualDistance | None:
    """LPIPS 0.1 with AlexNet, or None where the weights are not on this machine."""
    path = _hub_folder() / TRUNK_NAME
    linear_path = _package_file(*LPIPS_LINEAR)
    if linear_path is None or not path.is_file():
        return None
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    if not digest.startswith(TRUNK_NAME.removesuffix(".pth").rsplit("-", 1)[1]):
        return None
    return lpips_from(_load(path), _load(linear_path))


def lpips_from(trunk: dict[str, Tensor], linear: dict[str, Tensor]) -> PerceptualDistance:
    """LPIPS from torchvision's state of AlexNet and the published linear weights."""
    convolutions = [(trunk[f"features.{i}.weight"], trunk[f"features.{i}.bias"]) for i in (0, 3, 6, 8, 10)]
    return PerceptualDistance(_alexnet_stages(), convolutions, _linear(linear))


def load_st_lpips() -> PerceptualDistance | None:
    """ST-LPIPS with its shift-tolerant AlexNet, or None where the package is not installed."""
    path = _package_file(*ST_LPIPS)
    if path is None:
        return None
    state = _load(path)
    names = ("slice1.0", "slice2.5", "slice3.9", "slice4.11", "slice5.13")
    convolutions = [(state[f"net.{name}.weight"], state[f"net.{name}.bias"]) for name in names]
    return PerceptualDistance(_shift_tolerant_stages(), convolutions, _linear(state))


def _linear(state: dict[str, Tensor]) -> list[Tensor]:
    return [state[f"lin{i}.model.1.weight"] for i in range(5)]


def _hub_folder() -> Path:
    return Path(torch.hub.get_dir()) / "checkpoints"


def _package_file(package: str, name: str) -> Path | None:
    """A file of an installed package, found without importing the package."""
    spec = importlib.util.find_spec(package)
    for folder in (spec and spec.submodule_search_locations) or ():
        path = Path(folder) / name
        if path.is_file():
            return path
    return None


def _load(path: Path) -> dict[str, Tensor]:
    state: dict[str, Tensor] = torch.load(path, map_location="cpu", weights_only=True)
    return state
