"""MAVLink's bytes: framing, dialect, signatures, logs, and the scaling of every field."""
