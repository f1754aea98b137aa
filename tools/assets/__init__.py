"""Make shipped assets, generated pages and pictures of the documentation."""
