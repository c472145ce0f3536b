"""What speaks against a sensor that seems to work: each watch holds what it tells against something else that is known."""
