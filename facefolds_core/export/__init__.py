"""From a trained model to meshes and textures; the stages call `steps.py`."""
