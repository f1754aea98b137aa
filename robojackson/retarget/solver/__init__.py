"""The solver of a whole clip and the terms of its cost."""
