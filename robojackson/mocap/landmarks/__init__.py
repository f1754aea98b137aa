"""From detected landmarks to refined points in front of a camera."""
