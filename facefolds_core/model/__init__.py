"""The model: N static nested surfaces with RGBA textures in time. All stages after training use `RadianceManifolds`."""

from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import load_model, save_model

__all__ = ["RadianceManifolds", "load_model", "save_model"]
