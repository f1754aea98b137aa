"""Put the motion on the floor: gravity, contacts, foot pinning."""
