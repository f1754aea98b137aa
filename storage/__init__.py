"""The tables of the project: schemas, atomic Parquet files, artifacts and the store."""
