"""The two trainers; `trainers` picks one by the keys."""
