"""``companion trial``: a sea trial from a station's command line."""
