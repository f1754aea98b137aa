"""What is installed, what is missing, and a report of it for an issue."""
