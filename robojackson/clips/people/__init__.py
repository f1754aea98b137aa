"""People in a clip, and how the camera moves around them."""
