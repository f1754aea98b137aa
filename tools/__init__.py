"""Scripts that made the assets: pose bundles, rendered dancers, the authored hip-shake."""
