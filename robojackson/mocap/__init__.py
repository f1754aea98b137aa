"""Recover the motion of the person in a video."""
