"""The commands that run one stage, from files to files, with no Prefect in memory."""
