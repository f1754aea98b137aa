"""Configuration of training and evaluation."""
