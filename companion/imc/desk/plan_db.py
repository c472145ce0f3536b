"""PlanDB: the console's plans on the vehicle. Each request is answered once, to whoever asked (imc-wire §4).

A plan is kept whether or not it can be sailed here; what would be refused at START is told in the answer to SET already.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mavlink_bridge import imc

from .refusal import ConsoleRefusedError
from .shelf import Shelf, ShelvedPlan

_Op = imc.PlanDBOp


class PlanDatabase:
    """``judge`` tells what of a plan is passed over, or raises ConsoleRefusedError; ``changed`` is called after each change."""

    def __init__(
        self, shelf: Shelf, judge: Callable[[imc.PlanSpecification], str], changed: Callable[[], None]
    ) -> None:
        self._shelf = shelf
        self._judge = judge
        self._changed = changed
        self.unkept: imc.PlanSpecification | None = None
        """The plan that came with a START and is on no shelf: consoles ask for it when they see its name."""

    def answer(self, request: imc.PlanDB, asker: int, name: str, utc_s: float) -> imc.PlanDB:
        """Carry out a request of a console (its id and name)."""
        match request.op:
            case _Op.SET:
                return self._set(request, asker, name, utc_s)
            case _Op.DEL:
                return self._delete(request)
            case _Op.GET:
                return self._get(request)
            case _Op.GET_INFO:
                if request.plan_id not in self._shelf:
                    return _failure(request, "undefined plan")
                return _success(request, "OK", self._shelf.info(request.plan_id))
            case _Op.CLEAR:
                self._shelf.clear()
                self._changed()
                return _success(request, "OK")
            case _Op.GET_STATE | _Op.GET_DSTATE:
                return _success(request, "OK", self._shelf.state())
            case _Op.BOOT:
                return _success(request, "OK")
            case _:
                return _failure(request, f"operation {request.op} is not known")

    def find(self, name: str) -> imc.PlanSpecification | None:
        kept = self._shelf.get(name)
        if kept is not None:
            return kept.spec()
        return self.unkept if self.unkept is not None and self.unkept.plan_id == name else None

    def _set(self, request: imc.PlanDB, asker: int, name: str, utc_s: float) -> imc.PlanDB:
        spec = request.arg
        if not isinstance(spec, imc.PlanSpecification):
            return _failure(request, "there is no plan in it")
        if spec.plan_id != request.plan_id:
            return _failure(request, "plan id mismatch")
        unknown = imc.holds_unknown(spec)
        if unknown is not None:
            return _failure(request, f"it holds {imc.name_of(unknown.number)}, which is not read here")
        was_there = request.plan_id in self._shelf
        refusal = self._shelf.put(spec.plan_id, ShelvedPlan(imc.fields_bytes(spec), utc_s, asker, name))
        if refusal:
            return _failure(request, refusal)
        self._changed()
        info = "OK (updated)" if was_there else "OK (new entry)"
        return _success(request, info + self._remark(spec), self._shelf.info(spec.plan_id))

    def _remark(self, spec: imc.PlanSpecification) -> str:
        try:
            remark = self._judge(spec)
        except ConsoleRefusedError as refusal:
            return f", but START will refuse it: {refusal}"
        return f"; {remark}" if remark else ""

    def _get(self, request: imc.PlanDB) -> imc.PlanDB:
        spec = self.find(request.plan_id)
        return _failure(request, "undefined plan") if spec is None else _success(request, "OK", spec)

    def _delete(self, request: imc.PlanDB) -> imc.PlanDB:
        if not self._shelf.remove(request.plan_id):
            return _failure(request, "undefined plan")
        self._changed()
        return _success(request, "OK")


def _success(request: imc.PlanDB, info: str, arg: imc.Message | None = None) -> imc.PlanDB:
    return replace(request, type=int(imc.ReplyType.SUCCESS), arg=arg, info=info)


def _failure(request: imc.PlanDB, info: str) -> imc.PlanDB:
    return replace(request, type=int(imc.ReplyType.FAILURE), arg=None, info=info)
