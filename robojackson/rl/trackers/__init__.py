"""General trackers: networks that make a robot follow any reference motion, untrained on it."""
