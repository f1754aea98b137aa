"""Pictures of the commands' results, from files to files."""
