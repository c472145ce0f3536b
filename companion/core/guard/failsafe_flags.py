"""The flags that the failsafe judges: one picture of what is well and what is not, gathered by the vehicle every tick."""

from __future__ import annotations

from dataclasses import fields
from typing import Final

from mavlink_bridge.language.value import value

from .failsafe_orders import Order


@value
class Flags:
    """What the vehicle knows at this tick. Ages in s; None = never heard or not in use. Levels unless called events.

    ``vehicle_flags.gather`` gives them in this order.
    """

    armed: bool = False
    autonomous: bool = False
    """The mode in force steers by position or heading (everything but Manual)."""
    manual: bool = False
    """Manual mode with sticks."""
    operator_order: Order | None = None
    """Event: an operator chose a mode, started or resumed a plan, or gave a guided order."""
    operator_arm: bool = False
    """Event: an operator armed."""
    terminate: bool = False
    emergency_stop: bool = False
    """Level: the board's stop input."""
    aborted: bool = False
    """Event: an operator's forced disarm over a link."""
    gcs_required: bool = False
    gcs_age_s: float | None = None
    """Since the owner's last heartbeat on an ordinary link."""
    radio_age_s: float | None = None
    """Since the gateway's last authenticated beacon or other sign of the ground over the radio."""
    manual_age_s: float | None = None
    """Since the last stick message; None outside Manual."""
    guided_age_s: float | None = None
    """Since the last streamed set-point; None when nothing is streamed."""
    position_lost: bool = False
    heading_lost: bool = False
    position_frozen: bool = False
    sources_disagree: bool = False
    actuator_lost: bool = False
    """Silent, closed, blocked, or not negotiated after it had been."""
    actuator_reset: bool = False
    actuator_mismatch: bool = False
    """Applied differs from commanded (300 ms, judged by the codec)."""
    actuator_noise: bool = False
    """More than 5 % bad lines in 2 s."""
    actuator_garbage: bool = False
    """More than 50 % bad lines in 1 s."""
    depth_shallow: bool = False
    depth_locked: bool = False
    depth_ahead: bool = False
    depth_braking: bool = False
    """The guard takes the way off with astern thrust."""
    depth_lost: bool = False
    """The altitude is unknown although it matters (not: bottom out of the sounder's reach)."""
    depth_blind: bool = False
    """The altitude has been unknown longer than the policy ``stop`` or ``required`` allows."""
    fence_ahead: bool = False
    fence_breach: bool = False
    plan_invalid: bool = False
    battery_low: bool = False
    battery_critical: bool = False
    battery_empty: bool = False
    battery_lost: bool = False
    stuck: bool = False
    """Thrust without speed, already for the monitor's time."""
    moving_in_neutral: bool = False
    drifting_while_stopped: bool = False
    oscillating: bool = False
    thruster_weak: bool = False
    """A thruster gives much less than it is told to, as far as the hull's motion shows."""
    storage_fault: bool = False
    time_jump: bool = False
    """Event: the monotonic clock advanced more than 1 s between two ticks."""
    tick_late: bool = False
    """Event: this tick came more than 0.2 s late."""
    tick_very_late: bool = False
    """Event: this tick came more than 0.5 s late."""
    overruns: bool = False
    """More than 5 % late ticks in 10 s."""
    task_failing: bool = False
    """A supervised part failed five times in 60 s."""
    return_ordered: bool = False
    """The mode in force is a return that an operator ordered."""
    resume: str = ""
    """The mode that a failsafe broke off, by the name that stations show; "" = none."""

    def any_alarm(self) -> bool:
        """Whether anything is wrong that a flag says; ages are not looked at. One name for each of ``ALARMS``."""
        return (
            self.terminate
            or self.emergency_stop
            or self.aborted
            or self.position_lost
            or self.heading_lost
            or self.position_frozen
            or self.sources_disagree
            or self.actuator_lost
            or self.actuator_reset
            or self.actuator_mismatch
            or self.actuator_noise
            or self.actuator_garbage
            or self.depth_shallow
            or self.depth_locked
            or self.depth_ahead
            or self.depth_braking
            or self.depth_lost
            or self.depth_blind
            or self.fence_ahead
            or self.fence_breach
            or self.plan_invalid
            or self.battery_low
            or self.battery_critical
            or self.battery_empty
            or self.battery_lost
            or self.stuck
            or self.moving_in_neutral
            or self.drifting_while_stopped
            or self.oscillating
            or self.thruster_weak
            or self.storage_fault
            or self.time_jump
            or self.tick_late
            or self.tick_very_late
            or self.overruns
            or self.task_failing
        )


_CONTEXT: Final = ("armed", "autonomous", "manual", "operator_order", "operator_arm", "gcs_required", "return_ordered")
ALARMS: Final = tuple(item.name for item in fields(Flags) if item.type == "bool" and item.name not in _CONTEXT)
"""Names of the flags that are up only when something is wrong."""
