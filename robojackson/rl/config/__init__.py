"""Every number of training and evaluation."""
