"""What may be wrong with thrusters and rudders, found from what the hull does, and told as a suspicion: it acts on nothing.

``causes`` are the words, ``suspects`` what each cause would do to the hull, ``residual`` what the hull does beyond its model,
``weighing`` weighs them against each other, ``diagnosis`` is the whole of it for one vessel.
"""

from .causes import Cause, words
from .diagnosis import Diagnosis
from .weather import GALE_MPS

__all__ = ["GALE_MPS", "Cause", "Diagnosis", "words"]
