"""The asset: the border between what makes it and what shows it. See docs/asset-format.md."""

from facefolds_core.asset.manifest import Manifest
from facefolds_core.asset.reader import Asset, read_asset
from facefolds_core.asset.writer import AssetSource, write_asset

__all__ = ["Asset", "AssetSource", "Manifest", "read_asset", "write_asset"]
