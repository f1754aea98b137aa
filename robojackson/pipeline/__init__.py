"""Configuration and tables of a whole pass."""
