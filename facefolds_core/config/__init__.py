"""From params.yaml to the stages: one file a stage, and its digest of code."""
