"""The commands about trackers."""
