"""What is the subject, found once: a start representation of Gaussians, mattes from it, and what stands behind."""
