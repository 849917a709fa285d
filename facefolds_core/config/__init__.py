"""From params.yaml to the stages: one file a stage, its digest of code, and the page that explains the keys."""
