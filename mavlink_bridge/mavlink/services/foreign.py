"""Messages of things that this boat cannot do, which have no acknowledgement: each is answered by a text with its name."""

from __future__ import annotations

from typing import Final

CANNOT: Final = {
    "FOLLOW_TARGET": "follow me: this boat follows nobody; send go-tos instead",
    "SET_GPS_GLOBAL_ORIGIN": "global origin: this boat's is where it first had a position; nothing was set",
    "ODOMETRY": "odometry is not taken: this boat finds its place by its own receiver",
    "VISION_POSITION_ESTIMATE": "vision positions are not taken: this boat finds its place by its own receiver",
    "ATT_POS_MOCAP": "motion capture is not taken: this boat finds its place by its own receiver",
    "SET_ACTUATOR_CONTROL_TARGET": "actuators are not set one by one: use sticks or set-points",
}

"""By the message's name, what is said."""
