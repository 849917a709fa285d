"""The asset: the border between what makes it and what shows it. See docs/reference/asset-format.md.

Reading needs no torch, no numba and nothing of what makes an asset; `asset.writer` is imported by those who write.
"""

from facefolds_core.asset.manifest import Manifest
from facefolds_core.asset.reader import Asset, read_asset

__all__ = ["Asset", "Manifest", "read_asset"]
