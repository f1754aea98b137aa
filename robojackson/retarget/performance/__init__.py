"""Performances: several dances and the planned ways between them as one motion."""
