"""Two cameras that see the same dance: synchronised, calibrated by the dancer, triangulated."""
