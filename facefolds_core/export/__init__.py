"""From a trained model to meshes and textures: what the stages (pipeline/) call."""
