"""How the dancer that ships was taught: its motions, its training, its figures."""
