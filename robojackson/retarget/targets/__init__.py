"""What the robot is to follow: keypoints, contacts, the cycle of a clip."""
