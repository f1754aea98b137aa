"""Data types of motions, each a table."""
