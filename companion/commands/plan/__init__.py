"""``companion plan``: make, check, draw, send and fetch plans."""
