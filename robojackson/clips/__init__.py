"""Videos: reading, finding, assessing, and the people in them."""
