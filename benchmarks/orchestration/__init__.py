"""Cost of Prefect, the cache and the command line around the work."""
