"""From points to joint rotations."""
