"""How the bundled clips are made."""
