"""How a stage becomes a cached task, and how its process is run."""
