"""``companion trial``: what is typed is ordered, what the vessel says decides when it is over."""

import io

import pytest

from companion.cli import main
from companion.commands.plan.link import LinkError
from companion.commands.trial.watch import TrialWatch
from companion.tuning.fitted import vessel_toml
from mavlink_bridge.language.trials import TrialOrder
from tools.benches.cells.foreign_hulls import single_screw


class Vessel:
    def __init__(self):
        self.heard, self.shows_again, self.is_heard, self.orders = ["an old text"], False, True, []

    def order(self, order):
        self.orders.append(order)
        if order is TrialOrder.END:
            self.heard.append("Trial ended: ordered; 2 of 10 manoeuvres done")


@pytest.mark.parametrize(
    ("text", "done"),
    [
        ("Trial 2/10 in 5 s: straight at 35 %", None),
        ("Trial done, 1 left out: fit it with companion tune vessel", True),
        ("Trial ended: Hold ordered; 3 of 10 manoeuvres done", False),
        ("No sea trial is under way", False),
    ],
)
def test_the_vessels_texts_say_when_it_is_over(text, done):
    vessel = Vessel()
    vessel.heard.append("Trial done: this was the one before")
    watch = TrialWatch(vessel, vessel.order)
    assert watch.look() is None
    vessel.heard.append(text)
    assert watch.look() is done


def test_what_is_typed_is_ordered_and_anything_else_is_explained(capsys):
    vessel = Vessel()
    watch = TrialWatch(vessel, vessel.order)
    for line in ("Full\n", "\n", "faster\n"):
        watch.type(line)
    assert watch.look() is None
    assert vessel.orders == [TrialOrder.CONFIRM]
    assert "type 'full'" in capsys.readouterr().err
    assert watch.stay(io.StringIO("stop\n")) is False
    assert vessel.orders[-1] is TrialOrder.END


def test_an_order_without_answer_is_told_and_a_silent_vessel_too(capsys):
    vessel = Vessel()

    def lost(_):
        raise LinkError("command 31012: no answer")

    watch = TrialWatch(vessel, lost)
    watch.type("full")
    vessel.is_heard = False
    assert watch.look() is None
    vessel.is_heard = True
    assert watch.look() is None
    told = capsys.readouterr().err
    assert told.splitlines() == ["command 31012: no answer", "the vessel is not heard", "the vessel is heard again"]


def test_the_plan_is_listed_without_a_vessel(capsys):
    assert main(["trial", "plan", "--quick"]) == 0
    quick = capsys.readouterr().out
    assert main(["trial", "plan"]) == 0
    whole = capsys.readouterr().out
    assert quick.startswith("  1  rest: the drift")
    assert "about 8 minutes" in quick
    assert "about 20 minutes" in whole


def test_the_plan_for_a_hull_that_does_not_turn_at_rest_has_no_spins(tmp_path, capsys):
    file = tmp_path / "single.toml"
    file.write_text(vessel_toml(single_screw()), encoding="utf-8")
    assert main(["trial", "plan", "--vessel", str(file)]) == 0
    told = capsys.readouterr().out
    assert "spin to" not in told
    assert "spins are left out" in told
    assert main(["trial", "plan"]) == 0
    assert "spin to starboard" in capsys.readouterr().out
