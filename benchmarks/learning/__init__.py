"""What learning costs and what comes out of it."""
