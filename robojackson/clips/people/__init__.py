"""Who is in a clip, and how the camera moves around them."""
