"""Tables of DVC's experiments, and keys set for one subject."""
