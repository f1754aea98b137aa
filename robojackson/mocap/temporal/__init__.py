"""Our own NIKI through time: what the detector gets wrong in depth, and how sure that is."""
