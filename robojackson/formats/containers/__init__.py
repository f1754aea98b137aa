"""Archives, pickles and BVH trees, read without running anything in them."""
