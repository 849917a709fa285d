"""FaceFolds: multi-view face video to nested textured meshes with an RGBA texture video."""

__version__ = "0.2.0"
