"""Servers, deployments and the environment of a run."""
