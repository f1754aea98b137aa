"""One thin cached Prefect task a stage."""
