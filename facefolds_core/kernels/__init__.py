"""What compiled loops have in common: how numba compiles and keeps them, sums that threads share, a ray's hits."""
