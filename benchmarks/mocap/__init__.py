"""Accuracy of motion capture against ground truth."""
