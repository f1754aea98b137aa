"""Videos on the web: what is offered, which is taken, and its download."""
