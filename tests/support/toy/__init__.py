"""A third controller that the source does not know: it shows that the contracts of `steptwin.controller` are enough.

A `Toy` has one axis, an input STOP and an output BUSY, and is commanded by two bytes: a letter and a number. `ToyPort` is its
line, `ToyLine` the line of a world with one toy on it, `ToyBody` what can fail. `toy.kind` makes a kind of
controller of it, for worlds.
"""

from toy.controller import ACCELERATION_P, STEP_P, VELOCITY_P, Bare, Driven, Toy, ToyAxis
from toy.faults import ToyBody
from toy.line import ToyLine, ToyPort

__all__ = ["ACCELERATION_P", "STEP_P", "VELOCITY_P", "Bare", "Driven", "Toy", "ToyAxis", "ToyBody", "ToyLine", "ToyPort"]
