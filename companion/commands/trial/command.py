"""``companion trial``: let a vessel measure itself, and watch it: plan, start, confirm, status, stop.

A ground station like any other, through MAVSDK as ``companion plan`` is. ``start`` stays until the trial is over, because the
vessel wants the station that commands to be present: it ends the trial when that falls silent. Whoever leaves ends it.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, Final

from mavlink_bridge.language.trials import TRIAL_RADIUS_M, TrialOrder
from mavlink_bridge.mavlink.commands.table import TRIAL_NUMBERS
from mavlink_bridge.mavlink.wire.cmd import Cmd

from ...core.hull import ForceModel
from ...core.trial import LEAST_RADIUS_M, MOST_RADIUS_M, NO_SPINS, manoeuvres_of
from ...core.trial.manoeuvres import about_s, words_of
from ...settings import load_vessel
from ..numbers import number
from ..plan.command import add_action, vessel_action
from ..plan.leaving import HOLDS, leave
from ..plan.link import LinkError
from .watch import TrialWatch

_ASKED: Final = {
    TrialOrder.LOOK: "allow a sea trial here",
    TrialOrder.BEGIN: "begin a sea trial",
    TrialOrder.CONFIRM: "take the whole throttle",
    TrialOrder.TELL: "tell of a sea trial",
    TrialOrder.END: "end a sea trial",
}
"""What the vessel refuses, in words for people."""


def register(subparsers: Any) -> None:
    """Add the command and its own sub-commands."""
    parser = subparsers.add_parser("trial", help="a sea trial: the vessel measures itself", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    plan = add_action(actions, "plan", _plan, "list the manoeuvres and how long they take; nothing is sent")
    plan.add_argument("--quick", action="store_true", help="the short one")
    plan.add_argument("--vessel", default="", metavar="F.toml", help="what this hull cannot sail is left out")
    look = vessel_action(actions, "check", _check, "ask the vessel whether a trial may begin where it is")
    start = vessel_action(actions, "start", _start, "arm, begin, and stay until it is over")
    for each in (look, start):
        each.add_argument("--quick", action="store_true", help="about 8 minutes instead of 20")
        each.add_argument(
            "--radius",
            type=number(LEAST_RADIUS_M, MOST_RADIUS_M),
            default=TRIAL_RADIUS_M,
            metavar="M",
            help=f"of the circle around the vessel (default {TRIAL_RADIUS_M:.0f})",
        )
        each.add_argument(
            "--fit", action="store_true", help="keep to what fence and chart leave of the circle, as a polygon"
        )
    start.add_argument("--no-arm", action="store_true", help="it is armed already")
    vessel_action(actions, "confirm", _confirm, "you have seen the first manoeuvres: allow the whole throttle")
    vessel_action(actions, "status", _status, "what is done, what comes, how long")
    vessel_action(actions, "stop", _stop, "end it; the vessel keeps its place")


def _order(vessel: Any, order: TrialOrder, *params: float) -> None:
    vessel.command(_ASKED[order], Cmd.SEA_TRIAL, TRIAL_NUMBERS[order], *params)


def _area(arguments: argparse.Namespace) -> tuple[float, float, float]:
    return arguments.radius, float(arguments.quick), float(arguments.fit)


def _plan(arguments: argparse.Namespace) -> int:
    turns = not arguments.vessel or ForceModel(load_vessel(arguments.vessel)).turns_at_rest
    groups = manoeuvres_of(quick=arguments.quick, turns_at_rest=turns)
    for k, group in enumerate(groups):
        print(f"{k + 1:3}  {words_of(group)}")
    if not turns:
        print(NO_SPINS)
    print(
        f"about {about_s(groups) / 60.0:.0f} minutes; at half throttle until you confirm; each is announced 5 s ahead"
    )
    return 0


def _check(vessel: Any, arguments: argparse.Namespace) -> None:
    _order(vessel, TrialOrder.LOOK, *_area(arguments))
    vessel.hear_reason()


def _start(vessel: Any, arguments: argparse.Namespace) -> None:
    """Begin, and stay. Raises LinkError when it is refused or ends before it is done."""
    _order(vessel, TrialOrder.LOOK, *_area(arguments))
    with vessel.arming(arm=not arguments.no_arm):
        _order(vessel, TrialOrder.BEGIN, *_area(arguments))
    minutes = about_s(manoeuvres_of(quick=arguments.quick)) / 60.0
    print(
        f"begun: at most {minutes:.0f} minutes. 'full' and Enter: the whole throttle; 'stop' and Enter, or Ctrl-C: end it"
    )
    watch = TrialWatch(vessel, lambda order: _order(vessel, order))
    try:
        if not watch.stay(sys.stdin):
            raise LinkError("the trial ended before it was done; what was sailed can be fitted, it may be too little")
        print("done; fit it: companion tune vessel RUN --vessel FILE, with the run's folder from the vessel")
    finally:
        leave(vessel, HOLDS)


def _confirm(vessel: Any, arguments: argparse.Namespace) -> None:
    _order(vessel, TrialOrder.CONFIRM)
    vessel.hear_reason()


def _status(vessel: Any, arguments: argparse.Namespace) -> None:
    _order(vessel, TrialOrder.TELL)
    vessel.hear_reason()


def _stop(vessel: Any, arguments: argparse.Namespace) -> None:
    _order(vessel, TrialOrder.END)
    vessel.hear_reason()
    print("ended; the vessel keeps its place")
