"""How shipped assets and pictures of the documentation are made."""
