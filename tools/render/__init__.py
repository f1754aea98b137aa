"""Render the bundled clips."""
