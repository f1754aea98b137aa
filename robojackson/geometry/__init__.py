"""Rotations and the only places where axes change."""
