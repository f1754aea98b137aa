"""Metrics, one definition each, for tests, flows and reports."""
