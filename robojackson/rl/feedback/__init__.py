"""Linear feedback that holds a robot on a motion, and the feasible paths that it follows."""
