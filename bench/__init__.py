"""Measurements: training time against accuracy, robustness and hazards, export, bytes, sweeps, and players."""

import stages as stages  # threads wait as those of the stages do: what is measured is what users get
