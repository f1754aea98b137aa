"""Fitness of a clip for motion capture, and choice of the best candidate."""
