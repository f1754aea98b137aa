"""The algorithm: networks, replay, updates and the trainers."""
