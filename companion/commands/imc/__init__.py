"""``companion imc``."""
