"""Learning to dance: environments, rewards, the TQC trainers, policies and their evaluation."""
