"""Targets of the solver: keypoints, contacts, the cycle of a clip."""
