"""Data for the browser: shapes, motions and sound inside one file."""
