"""Measurements of the trainers: speed against accuracy, robustness, and a profile of one step."""
