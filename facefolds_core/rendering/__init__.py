"""Rendering of assets. It reads files that ship (facefolds_core.asset) and knows nothing of models."""

from facefolds_core.rendering.reference import AssetCaster, Hits, composite, render_asset

__all__ = ["AssetCaster", "Hits", "composite", "render_asset"]
