"""The model: N static nested surfaces with RGBA textures in time. All stages after training use `RadianceManifolds`."""

from facefolds_core.model.intersection import Crossings
from facefolds_core.model.radiance import RadianceManifolds, Rendered
from facefolds_core.model.storage import load_model, save_model

__all__ = ["Crossings", "RadianceManifolds", "Rendered", "load_model", "save_model"]
