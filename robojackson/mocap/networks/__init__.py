"""The published networks HybrIK and NIKI, for users who have their weights."""
