"""What the robot can do of a motion: dynamics, contact forces, tempo."""
