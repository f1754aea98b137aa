"""The commands that need Prefect or the store."""
