"""The past that questions are about: what was noted of it, and worlds in the state of each of its moments."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence

from steptwin.controller import Nanos
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.why.axes import POSITION
from steptwin.why.causes import Causes
from steptwin.why.chain import Cause
from steptwin.why.controllers import axis_of
from steptwin.why.lacking import Lacking
from steptwin.why.log import MOST_NOTED, CauseLog, in_parts
from steptwin.why.names import QuestionNames
from steptwin.why.states import StatesOnTheWay

WHY_NOT = "not "
"""Beginning of a question for what a condition lacks."""


class NotedPast:
    """The past of a world from the one that ``make`` gives on.

    ``inputs`` are what came from outside since then, ``end`` is the present, in ns. ``most``: limit of what is noted; ``before``:
    takes what lacks because it was before; ``others``: causes of a moment before, if they are noted.
    """

    def __init__(
        self,
        make: Callable[[], Simulation],
        inputs: Iterable[RecordedInput],
        end: Nanos,
        most: int = MOST_NOTED,
        before: Lacking | None = None,
        others: Callable[[Nanos], Causes | None] = lambda moment: None,
    ) -> None:
        self.make = make
        self.inputs = list(inputs)
        self.end = end
        self.log = CauseLog(make(), most, before)
        self._others = others
        self.names = QuestionNames(self.log)
        self.causes = Causes(self.log, others)
        self.on_the_way = StatesOnTheWay(self.log.world)

    def go_on(self, inputs: Iterable[RecordedInput], end: Nanos) -> None:
        """The present is a later one: what came from outside since."""
        self.inputs += inputs
        self.end = end

    def running(self) -> Generator[None, None, None]:
        """Note what happened until the present, in parts."""
        for _ in self.log.run(self.inputs, self.end):
            self.on_the_way.pass_by(self.log.inputs)
            yield
        self.causes = Causes(self.log, self._others)  # programs may be others by now

    def world_at(self, at: Nanos) -> Generator[None, None, Simulation]:
        """Another world in the state of a moment of the past."""
        other, state = self.make(), next(self.on_the_way.until(at))
        other.restore(state.snapshot)
        for _ in in_parts(other, self.inputs[state.inputs :], at):
            yield
        return other

    def behind(self, signals: Iterable[str], at: Nanos) -> set[str]:
        """Signals, and those that drive one of them, as far as they have a part in its level."""
        waiting, seen = list(signals), set[str]()
        while waiting:
            name = waiting.pop()
            if name not in seen:
                seen.add(name)
                drivers = self.causes.holding.deciding(name, self.causes.drivers(name, at), at)
                waiting += (*drivers, *self.causes.elements.behind(name))
        return seen

    def changeable(self, names: Sequence[str], at: Nanos) -> Iterator[tuple[str, Resource]]:
        """Resources on which signals depend and that programs can change, with their controllers: outputs, axes, values."""
        world = self.log.world
        variable = self.names.variable(names[0]) if len(names) == 1 else None
        if variable is not None:
            yield variable[0], Resource(ResourceKind.VALUE, variable[1])
            return
        for name in self.behind(names, at):
            owner, _, rest = name.partition(".")
            if owner in world.axes and rest == POSITION:
                drive = world.axes[owner].spec.drive
                yield drive[0], Resource(ResourceKind.AXIS, drive[1].removeprefix("M"))
            elif owner in world.programs and rest in self.pins(name):
                yield owner, Resource(ResourceKind.PIN, rest)
            elif owner in world.programs:
                axis = axis_of(rest)
                is_moving = self.names.is_signal(name) and world.signal(name).continuous
                if axis is not None or (is_moving and len(world.controllers[owner].axes) == 1):
                    yield owner, Resource(ResourceKind.AXIS, "1") if axis is None else axis._replace(name=axis.name or "1")
                yield from ((owner, one) for one in self.causes.programs.values_at(owner, rest))

    def names_in(self, text: str) -> Sequence[str]:
        """The signals of a question, or the variable."""
        if self.names.variable(text) is not None:
            return [text]
        return [self.names.canonical(name) for name in parse_condition(self.names.named(without_not(text))).names()]

    def pins(self, name: str) -> Collection[str]:
        """The pins of the controller that has a signal."""
        controller = self.log.world.controllers.get(name.partition(".")[0])
        return () if controller is None else controller.pins()

    def tried(self, controller: str, wanted: Resource, at: Nanos) -> Cause | None:
        """The last command to an axis that stands which moved nothing."""
        motion = self.causes.axes.motion(controller, wanted.name, at) if wanted.kind is ResourceKind.AXIS else None
        if wanted.kind is not ResourceKind.AXIS or (motion is not None and motion.cover is not None):
            return None
        after = -1 if motion is None else motion.place.time
        return self.causes.attempts.last(controller, wanted.name, at, after=after)


def text_of_question(question: str) -> str:
    return question.strip().removeprefix("why ").strip()


def without_not(text: str) -> str:
    return text.removeprefix(WHY_NOT).strip()
