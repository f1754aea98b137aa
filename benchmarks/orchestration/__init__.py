"""What Prefect, the cache and the command line cost around the work."""
