"""Rollouts of policies and baselines, and their figures."""
