"""YAML that a user edits, and the one loader that reads it."""
