"""A console made of imcpy, which wraps DUNE's own code: finds the boat, sends a loiter, starts, watches, stops, aborts, reads back.

``imcpy_console.py NAME LAT_DEG LON_DEG``. Prints one JSON object a line: the step, seconds since start, what was seen.
"""

from __future__ import annotations

import json
import math
import sys
import time

import imcpy
from imcpy.actors import DynamicActor
from imcpy.decorators import Periodic, Subscribe

NAME, LAT_DEG, LON_DEG = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
STARTED = time.monotonic()
DB, CONTROL, STATE = imcpy.PlanDB, imcpy.PlanControl, imcpy.PlanControlState


def say(step, **more):
    print(json.dumps({"step": step, "at_s": round(time.monotonic() - STARTED, 3), **more}), flush=True)


def loiter_plan():
    loiter = imcpy.Loiter()
    loiter.lat, loiter.lon, loiter.radius = math.radians(LAT_DEG), math.radians(LON_DEG), 20.0
    loiter.speed, loiter.speed_units, loiter.z_units = 1.5, imcpy.SpeedUnits.METERS_PS, imcpy.ZUnits.DEPTH
    loiter.type, loiter.direction = imcpy.Loiter.LoiterTypeEnum.CIRCULAR, imcpy.Loiter.DirectionEnum.CLOCKW
    node = imcpy.PlanManeuver()
    node.maneuver_id, node.data = "L1", loiter
    plan = imcpy.PlanSpecification()
    plan.plan_id, plan.start_man_id = "imcpy-1", "L1"
    plan.maneuvers.append(node)
    return plan


class Console(DynamicActor):
    def __init__(self):
        super().__init__(imc_id=0x4123)
        self.heartbeat = [NAME]
        self.done = set()
        self.first = None
        self.sent_s = 0.0
        self.request = 0
        self.stopped_s = None

    def once(self, step, **more):
        if step not in self.done:
            self.done.add(step)
            say(step, **more)
            return True
        return False

    def ask(self, message, kind, op, **fields):
        self.request += 1
        message.type, message.op, message.request_id = kind, op, self.request
        for name, value in fields.items():
            setattr(message, name, value)
        self.sent_s = time.monotonic()
        self.send(NAME, message)

    def database(self, op, **fields):
        self.ask(DB(), DB.TypeEnum.REQUEST, op, **fields)

    def control(self, op, **fields):
        self.ask(CONTROL(), CONTROL.TypeEnum.REQUEST, op, **fields)

    @Subscribe(imcpy.Announce)
    def listed(self, msg):
        if msg.sys_name == NAME:
            self.once("listed")

    @Subscribe(imcpy.EstimatedState)
    def moves(self, msg):
        here = (math.degrees(msg.lat), math.degrees(msg.lon))
        if self.first is None:
            self.first = here
            say("state", lat_deg=here[0], lon_deg=here[1])
            self.database(DB.OperationEnum.SET, plan_id="imcpy-1", arg=loiter_plan())
        north = (here[0] - self.first[0]) * 111_000
        far = math.hypot(north, (here[1] - self.first[1]) * 83_000) > 5.0
        if "executing" in self.done and far and self.once("moved", speed_mps=round(math.hypot(msg.vx, msg.vy), 2)):
            self.control(CONTROL.OperationEnum.STOP)

    @Subscribe(imcpy.PlanDB)
    def stored(self, msg):
        if msg.type == DB.TypeEnum.SUCCESS and msg.op == DB.OperationEnum.SET and self.once("stored"):
            self.database(DB.OperationEnum.GET, plan_id="imcpy-1")
        elif msg.op == DB.OperationEnum.GET and "read back" not in self.done:
            same = msg.arg is not None and msg.arg.serialize_fields() == loiter_plan().serialize_fields()
            self.once("read back", identical=same)
            self.control(CONTROL.OperationEnum.START, plan_id="imcpy-1")

    @Subscribe(imcpy.PlanControl)
    def controlled(self, msg):
        took_s = round(time.monotonic() - self.sent_s, 3)
        if msg.op == CONTROL.OperationEnum.START and msg.type != CONTROL.TypeEnum.IN_PROGRESS:
            self.once(
                "start answered" if "again" not in self.done else "start answered again",
                type=int(msg.type),
                took_s=took_s,
                info=msg.info,
            )
        if msg.op == CONTROL.OperationEnum.STOP and self.once(
            "stop answered", type=int(msg.type), took_s=took_s, info=msg.info
        ):
            self.stopped_s = time.monotonic()

    @Subscribe(imcpy.PlanControlState)
    def plan_state(self, msg):
        if msg.state == STATE.StateEnum.EXECUTING:
            self.once("executing", took_s=round(time.monotonic() - self.sent_s, 3), plan=msg.plan_id, man=msg.man_id)
            if "again" in self.done and self.once("executing again"):
                self.send(NAME, imcpy.Abort())
        elif msg.state == STATE.StateEnum.BLOCKED and "executing again" in self.done:
            self.once("blocked", outcome=int(msg.last_outcome))

    @Subscribe(imcpy.VehicleState)
    def vehicle_state(self, msg):
        if "executing again" in self.done and msg.op_mode == imcpy.VehicleState.OperationModeEnum.ERROR:
            self.once("aborted", words=msg.last_error)

    @Periodic(0.5)
    def drive(self):
        now_s = time.monotonic()
        if self.stopped_s is not None and now_s - self.stopped_s > 2.0 and self.once("again"):
            self.control(CONTROL.OperationEnum.START, plan_id="imcpy-1")
        if {"blocked", "aborted"} <= self.done or now_s - STARTED > 80.0:
            say("end")
            self.stop()


Console().run()
