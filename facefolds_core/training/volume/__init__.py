"""A coarse volume from the images alone: where the subject is, before there are layers."""
