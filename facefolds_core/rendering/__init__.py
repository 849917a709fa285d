"""Rendering of assets. It reads files that ship (facefolds_core.asset) and knows nothing of models."""
