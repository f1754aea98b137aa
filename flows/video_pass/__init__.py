"""The stages of one pass from a video to a dancing robot, with or without Prefect."""
