"""The robot: its description, its model, its kinematics."""
