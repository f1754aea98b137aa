"""Our own NIKI through time: corrections of the detector's depth, and their uncertainty."""
