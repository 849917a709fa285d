"""Training of the explicit model (preset `fast`)."""
