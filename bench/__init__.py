"""Measurements: training time against accuracy, robustness and hazards, export, bytes, sweeps, and players."""
