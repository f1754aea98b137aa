"""Stages as functions on dataclasses."""
