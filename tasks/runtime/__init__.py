"""Turn a stage into a cached task, and run its process."""
