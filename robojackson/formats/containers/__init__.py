"""Archives and pickles, read without running anything in them."""
