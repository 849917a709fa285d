"""Takes of any length: a base from key frames, and each frame fitted alone against it."""
