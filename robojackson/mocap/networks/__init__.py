"""The published networks HybrIK and NIKI, for users with a copy of the weights."""
