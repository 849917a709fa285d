"""The glTF 2.0 extension EXT_layered_volumetric_video: what it says, written, and checked.

Its text: docs/reference/EXT_layered_volumetric_video/README.md.
"""
