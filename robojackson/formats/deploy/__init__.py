"""The deploy pack: a policy with all that a robot needs to run it and nothing of RoboJackson."""
