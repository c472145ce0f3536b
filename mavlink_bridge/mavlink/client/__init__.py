"""MAVLink as a ground station speaks it, towards any vehicle: heard state, orders with answers, plans, parameters. No I/O, no clock.

The rest of ``mavlink`` is the vessel's side; this room is the other end of the link, for who commands a vehicle by something else
than MAVLink. ``VehicleClient`` is its face.
"""

from .client import ClientConfig, VehicleClient
from .exchange import Job, JobOutcome, Step
from .vehicle import Autopilot, HeardVehicle

__all__ = ["Autopilot", "ClientConfig", "HeardVehicle", "Job", "JobOutcome", "Step", "VehicleClient"]
