"""What assessing a video costs."""
