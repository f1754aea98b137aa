"""Many copies of a robot, stepped together."""
