"""Design work on the ground: models for python-control, margins, identification. Never imported by the vessel process."""
