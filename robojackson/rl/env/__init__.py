"""The environment, as array code and behind the interfaces of Gymnasium and SB3."""
