"""How fit a clip is for motion capture, and which candidate is best."""
