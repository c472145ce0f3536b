"""MAVLink, a leaf protocol on the vessel's language: bytes in, requests out; replies and snapshots in, bytes out."""
