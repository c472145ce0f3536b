"""Settings of the console's desk."""

from __future__ import annotations

from pydantic import Field

from ..core.config import Config


class DeskConfig(Config):
    """Who may command by IMC, and what is known of the vessel."""

    read_only: bool = False
    """Consoles see the vessel and command nothing; no order of theirs is passed on, an Abort neither."""
    may_arm: bool = True
    """START and teleoperation arm the vessel, when the console that commands orders them."""
    commander_ids: tuple[int, ...] = ()
    """IMC ids of the consoles that may command, one at a time; empty: any. Stopping is open to all."""
    console_timeout_s: float = Field(5.0, ge=2.0, le=120.0)
    """The commanding console counts as silent after this; another may command then. To the vessel it is silent at once."""
    full_speed_mps: float | None = Field(None, gt=0.0, le=50.0)
    """What a console's 100 % is, m/s. Not set: speeds in percent are refused."""
    max_plans: int = Field(200, ge=1, le=1000)
    """How many plans are kept; 2 MB together are the most."""
    stick_hold_s: float = Field(1.0, ge=0.2, le=5.0)
    """Sticks that are not repeated are neutral after this."""
    answer_s: float = Field(30.0, ge=1.0, le=600.0)
    """How long the vessel may take to answer an order; behind a radio it takes seconds."""
