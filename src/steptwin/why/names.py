"""The names in questions: signals, contacts, points of controllers, registers and variables of programs, scripts."""

from __future__ import annotations

import re
from collections.abc import Iterator

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.points import LivePoint
from steptwin.simulation.logic.expression import parse_condition
from steptwin.why.log import OF_MECHANICS, CauseLog

AMBIGUOUS_NAME = Message("why.ambiguous-name", "{name} is of {controllers}: ask with the controller, such as {example}")
VARIABLE_OF_A_PROGRAM = Message(
    "why.variable-of-a-program", "{name} is a variable of the program of {controller}: ask about it alone, not in a condition"
)
SWITCH = "switch"
"""The type of a point that is 0 or 1."""
SLIPS = {"stalled": ("stall",), "lost": OF_MECHANICS}
"""Signals of an axis that its rotor has, with the events between which they stand."""


class QuestionNames:
    """Finds what names mean in the world of a log."""

    def __init__(self, log: CauseLog) -> None:
        self._log = log

    def takes_values_between(self, name: str) -> bool:
        """Whether a quantity changes between events, but not from one level to the other as ``moving`` at the end of a motion."""
        if self._log.has(name) or not self._log.world.signal(name).continuous:
            return False
        if self.is_of_rotor(name) and name.endswith(".stalled"):
            return False
        point = self.point(name)
        return point is None or point.point.type != SWITCH

    def is_of_rotor(self, name: str) -> bool:
        """Whether a signal stands between the events of a rotor, also while its axis moves."""
        owner, _, rest = name.partition(".")
        return owner in self._log.world.axes and rest in SLIPS

    def is_coordinate(self, name: str) -> bool:
        """Whether a signal is the position of an axis as its controller counts it, which is not always that of its motor."""
        owner, _, rest = name.lower().partition(".")
        if owner not in self._log.world.controllers:
            return False
        is_moving = self.is_signal(name) and self._log.world.signal(name).continuous
        return is_moving and "pos" in rest and not rest.startswith("enc")

    def pin(self, name: str) -> str:
        """The input whose level, as its filter lets it in, a register shows; other names as they are."""
        owner, point = name.partition(".")[0], self.point(name)
        terminals = () if point is None else self._log.world.kind(owner).terminals.digital_inputs
        return f"{owner}.{point.point.path}" if point is not None and point.point.path in terminals else name

    def point(self, name: str) -> LivePoint | None:
        """The point of a controller with this name; None for what is none."""
        owner, _, rest = name.partition(".")
        world = self._log.world
        return world.kind(owner).point(world.controller(owner), rest) if owner in world.controllers else None

    def named(self, text: str) -> str:
        """The condition with names that leave out their controller in full, where there is only one that has it."""
        world = self._log.world
        for name in dict.fromkeys(parse_condition(text).names()):
            if not self.has(name):
                having = [controller for controller in world.controllers if self.has(f"{controller}.{name}")]
                full = [f"{controller}.{name}" for controller in having] or list(self._registers(name))
                if len(full) > 1:
                    owners = [one.partition(".")[0] for one in full]
                    raise Misuse(AMBIGUOUS_NAME(name=name, controllers=" and ".join(owners), example=full[0]))
                if not full:
                    self._refuse_variable(name)
                    world.signal(name)
                text = re.sub(rf"(?<![\w.$]){re.escape(name)}(?![\w.])", full[0], text)
        return text

    def _refuse_variable(self, name: str) -> None:
        """Raises `Misuse` for a variable of a program in a condition: its values are not noted."""
        variable = self.variable(name)
        if variable is not None:
            raise Misuse(VARIABLE_OF_A_PROGRAM(name=name, controller=variable[0]))

    def variable(self, text: str) -> tuple[str, str] | None:
        """The controller and the name of a variable of its program; None for what is none. Raises `Misuse` for one of several."""
        world = self._log.world
        found = [(name, text.removeprefix(f"{name}.")) for name in world.programs]
        found = [one for one in found if one[1] in world.programs[one[0]].variables(world.now)]
        if not found or self.has(text):
            return None
        if len(found) > 1:
            owners = " and ".join(name for name, _ in found)
            raise Misuse(AMBIGUOUS_NAME(name=text, controllers=owners, example=".".join(found[0])))
        return found[0]

    def _registers(self, name: str) -> Iterator[str]:
        """Meanings of a name of a program language for each controller with a program: ``table.USER_REGISTER[10]:real`` for
        ``$R10``, also with the controller before it."""
        owner, dot, rest = name.rpartition(".")
        for controller, programs in self._log.world.programs.items():
            point = programs.point(rest) if not dot or controller == owner else None
            if point is not None and self.is_signal(f"{controller}.{point}"):
                yield f"{controller}.{point}"

    def has(self, name: str) -> bool:
        """Whether there is a signal with this name, or a contact."""
        return self._log.has(name) or self.is_signal(name)

    def is_signal(self, name: str) -> bool:
        """Whether conditions can read it; a contact is none."""
        try:
            self._log.world.signal(name)
        except Misuse:
            return False
        return True

    def unit(self, name: str) -> str:
        """Unit of a signal; none of a contact."""
        return self._log.world.signal(name).unit if self.is_signal(name) else ""

    def canonical(self, name: str) -> str:
        """The name under which it is noted."""
        if self._log.has(name):
            return name
        owner, _, rest = name.partition(".")
        world = self._log.world
        if owner in world.controllers:
            point = (
                None
                if self._log.is_recorded(f"{owner}.{rest.upper()}")
                else world.kind(owner).point(world.controller(owner), rest)
            )
            path = rest.upper() if point is None else point.point.path
            is_register = path in world.controllers[owner].pins() and rest.upper() != path  # not the level at the terminal
            return f"{owner}.{rest.lower() if is_register else path}"
        return f"{owner}.{rest.lower()}"

    def is_script(self, name: str) -> bool:
        """Whether it is the name of a script, and of no signal."""
        return any(one.name == name for one in self._log.world.spec.scripts) and not self.has(name)
