"""What commands draw of their results, from files to files."""
