"""The published networks, HybrIK and NIKI, for the user who brings their weights."""
