"""Rows of trained policies: their bars, their references, and their tables in the documents."""
