"""The human body: skeleton, kinematics, analytic inverse kinematics, smoothing."""
