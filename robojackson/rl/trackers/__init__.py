"""General trackers: networks that make a robot follow any reference motion without training on
it."""
