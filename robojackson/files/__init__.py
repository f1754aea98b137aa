"""Files: written whole or not at all, and Parquet tables that are checked against a schema."""
