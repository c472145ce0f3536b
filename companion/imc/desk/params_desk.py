"""A console's view of the parameters: asked by part, set by part, told as they are aboard.

The list is fetched from the vehicle when the first console asks, and kept in step by what is set and told afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker
from mavlink_bridge.mavlink.client import Job, JobOutcome, VehicleClient
from mavlink_bridge.mavlink.client.exchange import DONE
from mavlink_bridge.mavlink.client.parameters import fetch

from .entities import ParamSections
from .orders import Helm, Values
from .plan import Setting

_MOST_WAITING = 64
_MOST_NAMED = 8
"""A line of the log has room for so many parameters."""

Tell = Callable[[imc.Message, Asker, str], None]


class ParamsDesk:
    """``answer`` sends a message to an asker under a label; ``say`` takes what an operator should read."""

    def __init__(
        self, client: VehicleClient, helm: Helm, parts: ParamSections, answer: Tell, say: Callable[[int, str], None]
    ) -> None:
        self._client = client
        self._helm = helm
        self._parts = parts
        self._answer = answer
        self._say = say
        self._waiting: list[tuple[str, Asker]] = []
        self._is_fetching = False
        self._has_all = False
        """The whole list has come once; what is set or told before that are single values."""

    @property
    def sections(self) -> Sequence[str]:
        return self._parts.sections

    def value(self, name: str) -> float | None:
        """A parameter as the vehicle last told it."""
        return self._parts.values.get(name)

    def heard(self, name: str, value: float) -> None:
        """The vehicle told a parameter."""
        self._parts.values[name] = value

    def query(self, section: str, asker: Asker, now_us: int) -> None:
        """Tell a part's parameters, when they are known: at once, or when the vehicle has told them."""
        if self._has_all:
            self._tell(section, asker)
        elif len(self._waiting) < _MOST_WAITING:
            self._waiting.append((section, asker))
            self.fetch(now_us)

    def fetch(self, now_us: int) -> None:
        """Have the vehicle tell its parameters, unless it is asked already."""
        vehicle = self._client.vehicle
        if vehicle is not None and not self._is_fetching:
            self._is_fetching = True
            self._client.start(fetch(vehicle, self._parts.values), self._fetched, now_us)

    def set(self, message: imc.SetEntityParameters, asker: Asker, now_us: int) -> bool:
        """Set what can be set, and tell the values that are then in force. Returns whether the vessel was ordered anything."""
        vehicle = self._client.vehicle
        if vehicle is None:
            self._say(4, f"{asker}: {message.name}: no parameter was set: the vessel is not heard")
            return False
        settings = tuple(Setting(message.name, each.name, each.value) for each in message.params)
        wanted = self.values_of(settings, f"{asker}: ")
        taken: list[str] = []

        def done(outcome: JobOutcome) -> None:
            if taken:
                values = ", ".join(f"{name} = {self._parts.text(name)}" for name in taken[:_MOST_NAMED])
                self._say(5, f"{asker}: {message.name}: {values}")
            if not outcome.ok:
                self._say(4, f"{asker}: {outcome.reason}")
            names = [each.name for each in message.params]
            self._tell(message.name, asker, names)

        self._client.start(self._put(wanted, taken), done, now_us)
        return bool(wanted)

    def _put(self, values: Values, taken: list[str]) -> Job:
        """Set one after the other, and note each as it is taken: what is refused takes nothing back."""
        for each in values:
            outcome = yield from self._helm.put((each,))
            if not outcome.ok:
                return outcome
            self.heard(*each)
            taken.append(each[0])
        return DONE

    def values_of(self, settings: tuple[Setting, ...], who: str = "") -> Values:
        """Settings as parameters; what is none is told, and ``who`` wanted it."""
        values: list[tuple[str, float]] = []
        for each in settings:
            wanted = self._parts.wanted(each.section, each.name, each.value)
            if isinstance(wanted, str):
                self._say(4, f"{who}{wanted}")
            else:
                values.append((each.name, wanted))
        return values

    def _fetched(self, outcome: JobOutcome) -> None:
        self._is_fetching, self._has_all = False, self._has_all or outcome.ok
        if not outcome.ok:
            self._say(4, outcome.reason)
        waiting, self._waiting = self._waiting, []
        for section, asker in waiting:
            self._tell(section, asker)

    def _tell(self, section: str, asker: Asker, names: Sequence[str] | None = None) -> None:
        texts = [each for each in self._parts.values_of(section) if names is None or each[0] in names]
        params = tuple(imc.EntityParameter(name=name, value=value) for name, value in texts)
        self._answer(imc.EntityParameters(name=section, params=params), asker, section)
