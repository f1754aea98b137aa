"""What the commands of learning do: requests, the training process, walkers."""
