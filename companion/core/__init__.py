"""The vessel's decisions: pure functions and small classes; no I/O, no clock, no MAVLink."""
