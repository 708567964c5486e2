"""A world, devices behind drivers, or both, as one subject. Devices come and go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from steptwin.controller import Nanos
from steptwin.devices.worldmember import NOTHING_KNOWN, WorldMember
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.later import start
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.commands import COMMANDS, Command, type_of
from steptwin.subject.contract import UNKNOWN, Description, Reading, Result
from steptwin.subject.events import Event, Numbering
from steptwin.subject.jogs import ExtendableJog
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.standing import StandingState
from steptwin.subject.subscriptions import Filter, Subscription, Subscriptions

TIME = "time"


class MemberSubject(Protocol):
    """A world, or a device; a member of a `CompositeSubject`."""

    @property
    def description(self) -> Description: ...
    @property
    def subscribers(self) -> Subscriptions: ...
    @property
    def lost(self) -> str | None:
        """Why nothing is known of it; None while it answers."""
        ...

    def read(self, *points: str) -> tuple[Reading, ...]: ...
    async def do(self, wanted: Command, /) -> Result: ...
    def plans(self, what: Filter) -> list[Event]: ...
    def selected(self, data: bytes) -> int | None:
        """The address on the line that characters begin with selecting; None without one."""
        ...

    async def begin_jog(self, wanted: command.Jog) -> ExtendableJog: ...


UNKNOWN_CONTROLLER = Message("devices.unknown-controller", "no controller is called {controller!r}{hint}; {known}")
THERE_ARE = Message("devices.there-are", "there are {names}")
NONE_IS_CONNECTED = Message("devices.none-is-connected", "no device is connected")
NAME_THE_CONTROLLER = Message("devices.name-the-controller", "{command}: name the controller")
NOT_POSSIBLE = Message("devices.not-possible", "{command} is not possible here; possible are {names}")
NOT_STOPPED = Message("devices.not-stopped", "not stopped: {problems}{also}")
ALSO_STOPPED = Message("devices.also-stopped", "; stopped: {names}")
ONE_CONTROLLER_AT_A_TIME = Message(
    "devices.one-controller-at-a-time", "{command}: one controller at a time where there are devices"
)
NO_DEVICE_FOR = Message("devices.no-device-for", "{command}: no device is connected")
NEEDS_AN_ADDRESS = Message(
    "devices.needs-an-address", "text: several devices are on {line}: it begins with the address of one of them, {known}, and CR"
)


class CompositeSubject:
    """Satisfies `steptwin.studio.surroundings.Served` and `steptwin.subject.jogs.Jogs`.

    A command goes to the member whose controller or line it names; one that names none to ``world``, or to the only device.

    ``clock`` and ``numbering`` are those of the world where there is one; all devices use them. ``machine``: what devices move,
    without a world; nothing is known of it but what they have.
    """

    def __init__(
        self,
        world: WorldMember | None,
        clock: Callable[[], Nanos],
        numbering: Numbering,
        machine: Description | None = None,
    ) -> None:
        self._world = world
        self._members: list[MemberSubject] = [] if world is None else [world]
        self.now = clock
        self.numbering = numbering
        self._subscriptions: list[Subscription] = []
        self._machine = machine
        self._unknown: set[str] = set() if machine is None else {one.name for one in (*machine.axes, *machine.elements)}
        """Owners of values that are unknown: parts of a machine, and removed controllers, which may still be watched."""
        self._describe()

    # ------------------------------------------------------------------ members

    def add(self, member: MemberSubject) -> None:
        self._members.append(member)
        for subscription in self._subscriptions:
            member.subscribers.add(subscription)
        self._describe()

    def remove(self, member: MemberSubject) -> None:
        self._members.remove(member)
        for subscription in self._subscriptions:
            member.subscribers.remove(subscription)
        self._unknown |= {controller.name for controller in member.description.controllers}
        self._describe()

    @property
    def has_devices(self) -> bool:
        return any(member is not self._world for member in self._members)

    def _describe(self) -> None:
        all_of = [member.description for member in self._members]
        self._of_controller = {
            controller.name: member for member in self._members for controller in member.description.controllers
        }
        self._of_unit = {
            (controller.line, controller.unit): member
            for member in self._members
            for controller in member.description.controllers
            if controller.is_real
        }
        self._of_line = {line.name: member for member in reversed(self._members) for line in member.description.lines}
        self._several = {name for name, count in Counter(line for line, _ in self._of_unit).items() if count > 1}
        """Lines with several devices."""
        can = {name for one in all_of for name in one.commands}
        controllers = tuple(controller for one in all_of for controller in one.controllers)
        base = self._machine or Description(", ".join(one.name for one in controllers) or "no device", ())
        if self._world is not None:
            base = all_of[0]
        self.description = replace(
            base,
            controllers=controllers,
            lines=tuple({line.name: line for one in all_of for line in one.lines}.values()),
            commands=tuple(name for name in COMMANDS if name in can),
        )

    def _member_called(self, controller: str) -> MemberSubject:
        """Raises `Misuse`."""
        member = self._of_controller.get(controller) or self._world
        if member is None:
            names = self._of_controller
            known = THERE_ARE(names=list(names)) if names else NONE_IS_CONNECTED()
            raise Misuse(UNKNOWN_CONTROLLER(controller=controller, hint=NearMiss().hint(controller, names), known=known))
        return member

    def _part_of(self, wanted: Command) -> MemberSubject:
        """Raises `Misuse`, and `Refusal` if no member can execute it."""
        if self._world is not None and len(self._members) == 1:
            return self._world  # there is nothing else that a command could be for
        found: list[MemberSubject] = []
        if isinstance(wanted, steps.Request) and (there := self._of_unit.get((wanted.line, wanted.unit))) is not None:
            return there  # several devices share the line
        if isinstance(wanted, steps.Send) and wanted.line in self._several:
            return self._addressed(wanted)
        for field in type_of(wanted).fields:
            value: Any = getattr(wanted, field.key)
            if field.name == "controller" and value is not None:
                found.append(self._member_called(value))
            elif field.name == "line" and value in self._of_line:
                found.append(self._of_line[value])
            elif field.name == "values" and value is not None:
                found += [self._member_called(controller) for controller, _, _ in value]
        if len(set(map(id, found))) > 1:
            raise Misuse(ONE_CONTROLLER_AT_A_TIME(command=type_of(wanted).name))
        if found:
            return found[0]
        if self._world is None and not self._members:
            raise Refusal(NO_DEVICE_FOR(command=type_of(wanted).name))
        if self._world is None and len(self._members) > 1:
            can = self.description.commands
            name = type_of(wanted).name
            raise Refusal(NAME_THE_CONTROLLER(command=name) if name in can else NOT_POSSIBLE(command=name, names=list(can)))
        return self._members[0]

    def _addressed(self, wanted: steps.Send) -> MemberSubject:
        """The device that characters on a line of several are for. Raises `Misuse` where they do not begin with its address."""
        address = self._of_line[wanted.line].selected(wanted.data)
        there = self._of_unit.get((wanted.line, address))
        if there is None:
            known = ", ".join(f"X{unit:X}" for line, unit in self._of_unit if line == wanted.line and unit is not None)
            raise Misuse(NEEDS_AN_ADDRESS(line=wanted.line, known=known))
        return there

    # ------------------------------------------------------------------ as `Served`

    @property
    def lost(self) -> str | None:
        return "; ".join(member.lost for member in self._members if member.lost is not None) or None

    def read(self, *points: str) -> tuple[Reading, ...]:
        if len(self._members) == 1 and not self._unknown:
            return self._members[0].read(*points)
        groups = self._by_member(points)
        found = {one.point: one for member, own in groups for one in member.read(*own)}
        return self._in_order(points, found)

    def _by_member(self, points: Iterable[str]) -> list[tuple[MemberSubject, list[str]]]:
        """Raises `Misuse`. Points of controllers that are gone, and the time, are left out."""
        groups: dict[int, tuple[MemberSubject, list[str]]] = {}
        for point in points:
            owner = point.partition(".")[0]
            if point != TIME and (owner not in self._unknown or owner in self._of_controller):
                member = self._member_called(owner)
                groups.setdefault(id(member), (member, []))[1].append(point)
        return list(groups.values())

    def _in_order(self, points: Sequence[str], found: Mapping[str, Reading]) -> tuple[Reading, ...]:
        present = Reading(TIME, self.now() / 1e9, "s")
        return tuple(present if point == TIME else found.get(point) or Reading(point, None, "", UNKNOWN) for point in points)

    async def do(self, wanted: Command, /) -> Result:
        match wanted:
            case command.StopAll():
                return self.result_of(await self._stop_all())
            case command.Describe() if self._world is None or len(self._members) > 1:
                return self.result_of(self.description.to_json())
            case command.Time() if self._world is None:
                now = self.now()
                at = {"time_ns": str(now), "time_s": now / 1e9}
                return self.result_of({"world": self.description.name, **at, "paused": False, "speed": 1.0, "stopped": None})
            case command.ReadPoints() if self._world is None or len(self._members) > 1:
                read = [(await member.do(command.ReadPoints(tuple(own)))).value for member, own in self._by_member(wanted.points)]
                found = {one["point"]: Reading(**one) for own in read for one in own}
                return self.result_of([one._asdict() for one in self._in_order(wanted.points, found)])
            case command.ReadPins() if wanted.controller is None and len(self._members) > 1:
                levels = [(await member.do(wanted)).value for member in self._members]
                return self.result_of({pin: level for own in levels for pin, level in own.items()})
            case _:
                return await self._part_of(wanted).do(wanted)

    async def _stop_all(self) -> object:
        """Stop all members at the same time; a failure of one does not affect the others.

        Raises `LineFailure` with the controllers that could not be stopped.
        """
        stopping = [(member, start(member.do(command.StopAll()))) for member in self._members]
        done: dict[str, list[str]] = {"controllers": [], "scripts": []}
        failed: list[str] = []
        for member, later in stopping:
            names = [controller.name for controller in member.description.controllers]
            try:
                stopped: Any = (await later).value
            except SteptwinError as error:
                failed.append(f"{', '.join(names)} ({error})")
            else:
                done["controllers"] += names
                done["scripts"] += stopped["scripts"] if member is self._world else []
        if failed:
            also = ALSO_STOPPED(names=done["controllers"]) if done["controllers"] else ""
            raise LineFailure(NOT_STOPPED(problems="; ".join(failed), also=also))
        return done

    def result_of(self, value: object) -> Result:
        if self._world is not None:
            return self._world.result_of(value)
        now = self.now()
        number = self.numbering.command(now)
        self.numbering.done()
        return Result(value, now, number)

    def present(self) -> dict[str, Any]:
        return dict(NOTHING_KNOWN) if self._world is None else dict(self._world.present())

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        subscription = Subscription(what, bound, self._unsubscribe)
        self._subscriptions.append(subscription)
        for member in self._members:
            member.subscribers.add(subscription)
        return subscription

    def _unsubscribe(self, subscription: Subscription) -> None:
        self._subscriptions.remove(subscription)
        for member in self._members:
            member.subscribers.remove(subscription)

    def workpieces(self) -> Sequence[WorkpieceState]:
        """As `PlannedSubject.workpieces`."""
        return () if self._world is None else self._world.workpieces()

    def standing(self) -> Sequence[StandingState]:
        """As `PlannedSubject.standing`."""
        return () if self._world is None else self._world.standing()

    def plans(self, what: Filter) -> list[Event]:
        return [event for member in self._members for event in member.plans(what)]

    # ------------------------------------------------------------------ as `Jogs`

    async def begin_jog(self, wanted: command.Jog) -> ExtendableJog:
        return await self._member_called(wanted.controller).begin_jog(wanted)
