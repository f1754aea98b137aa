"""Cost and results of learning."""
