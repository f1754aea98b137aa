"""Training of the temporal network (`python -m tools.temporal.train_temporal`)."""
