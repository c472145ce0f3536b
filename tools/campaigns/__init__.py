"""Long campaigns over hulls, waters and seeds: what is claimed of control, trials and diagnosis, each with a command that shows it."""
