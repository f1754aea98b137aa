"""How close motion capture comes to the truth."""
