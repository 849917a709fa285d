"""Cameras, poses, meshes, and the charts that give each direction its texture coordinates."""
