"""HTML pages and their content."""
