"""Cost of assessing a video."""
