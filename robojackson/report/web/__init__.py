"""What a browser draws and simulates: shapes, motions and sound inside one file."""
