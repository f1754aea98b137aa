"""From detected landmarks to refined points before a camera."""
