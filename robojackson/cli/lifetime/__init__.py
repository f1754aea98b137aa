"""Ctrl-C, and the end of every process that a command has started."""
