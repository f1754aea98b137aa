"""The deploy pack: a policy with everything that a robot needs to run it, without RoboJackson."""
