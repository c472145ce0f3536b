"""The minimum-altitude guard: soundings, charts and the boat's own memory of them, and the way ahead held against both."""
