"""How the assets were made: pose bundles, rendered dancers, the authored hip-shake."""
