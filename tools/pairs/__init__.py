"""Pairs of detector output and truth: rendered people of many kinds, seen by BlazePose."""
