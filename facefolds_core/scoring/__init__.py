"""What `evaluate` measures: pictures against photos, opacity against mattes, change over time."""
