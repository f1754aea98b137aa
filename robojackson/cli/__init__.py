"""Commands that run one stage, from files to files, without importing Prefect."""
