"""The two ways to learn a motion: observation, action, reward, reset."""
