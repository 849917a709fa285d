"""The documents; docs/tools makes what in them is made."""
