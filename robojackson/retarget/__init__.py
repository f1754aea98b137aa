"""Retargeting: human motion to robot motion."""
