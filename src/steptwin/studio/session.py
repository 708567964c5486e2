"""The session of one viewer: a request comes in, its answer goes out; and what the viewer is to be sent, when it can be sent.

Nothing waits here but places in streams and numbers of versions: a viewer that reads slowly gets the present, and less of the
past.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any, NamedTuple, TypeAlias

from steptwin.access.control import Viewer, check
from steptwin.access.rate import RateLimit
from steptwin.access.roles import LOOK, Permit, Role
from steptwin.errors import Misuse, Refusal
from steptwin.machine import SECOND, Nanos
from steptwin.studio import requests as ask
from steptwin.studio.hub import Hub
from steptwin.studio.messages import VERSION
from steptwin.studio.requests import OF_CONNECTION, REQUESTS, check_name, permit_of, read_request
from steptwin.studio.streams import Batch, Place
from steptwin.studio.watches import Watched
from steptwin.subject import commands as command
from steptwin.subject.commands import Command, read_command
from steptwin.subject.contract import Result
from steptwin.subject.dispatch import LONGEST_REQUEST, Message, failure, fields_of, respond
from steptwin.subject.following import Filter, filter_of
from steptwin.tables import complete

RATE, BURST = 200.0, 1000.0
"""Requests of a viewer in a second, and at once; stops besides."""
STOPS = frozenset({"stop", "stop_all"})
"""What needs no hello, and has a limit of its own."""
MOST_WATCHES = 32
MOST_WATCHED = 2000
"""Points of one viewer."""
MOST_FOLLOWS = 16
EVENTS_NS: Nanos = SECOND // 30
"""Events are sent at most this often."""
LONGEST_NAME = 40

Identity: TypeAlias = object
MOST_LEFT_OVER = 4
"""Batches of events that were waiting when what is followed changed."""


class Wanted(NamedTuple):
    """A request that was read. ``act`` does it; it gets the id of the message."""

    name: str
    fields: Mapping[str, object]
    act: Callable[[Identity], Result]


class Session:
    """Of a connection, or of one who asks over REST (``is_rest``), whose ``entered`` viewer is there from the beginning."""

    def __init__(self, hub: Hub, peer: str, *, entered: Viewer | None = None) -> None:
        self._hub = hub
        self._peer = peer
        self.is_rest = entered is not None
        self.viewer = entered or Viewer(hub.number(), peer, Role.VIEWER)
        """Until it has said hello: somebody who may look, and whom nobody sees."""
        self.has_entered = self.is_rest
        """Whether it has said hello."""
        self.is_refused = False
        """Whether it is to be cut off: it had a wrong token."""
        self._limit = RateLimit(RATE, BURST)
        self._stops = RateLimit(RATE, BURST)
        self._seq = count()
        self._needs_hello = False
        self._seen: dict[str, int] = {}
        self._watches: dict[int, Watched] = {}
        self._watch_numbers = count(1)
        self._follows: dict[object, tuple[Filter, int]] = {}
        self._place: Place | None = None
        self._left_over: list[Batch] = []
        """Events from before the follows were others."""
        self._missed = 0
        self._events_due: Nanos = 0
        self._now: Nanos = 0
        self._own: Mapping[object, Callable[[Any], object]] = complete(
            "request",
            [row.kind for row in REQUESTS.values()],
            "action",
            {
                ask.Hello: self._hello,
                ask.Resync: self._resync,
                ask.Watch: self._watch,
                ask.Unwatch: self._unwatch,
                ask.TakeControl: lambda wanted: hub.take_control(self.viewer, over=wanted.over),
                ask.ReleaseControl: lambda _: hub.release_control(self.viewer),
                ask.Renew: lambda wanted: hub.renew(self.viewer, wanted.lease),
                ask.LetGo: lambda wanted: hub.let_go(self.viewer, wanted.lease),
                ask.StopAll: lambda _: hub.stop_all(),
                ask.ListPrograms: lambda _: hub.around.programs.list(),
                ask.ReadProgram: lambda wanted: hub.around.programs.text(wanted.machine, wanted.place),
                ask.ReadAudit: lambda wanted: [entry.plain() for entry in hub.around.audit.last(wanted.most)],
            },
        )
        self._of_subject: Mapping[object, Callable[[Any, Identity], Result]] = {
            command.Jog: lambda wanted, _: self._done(hub.begin_jog(self.viewer, wanted)),
            command.StopAxes: lambda wanted, _: hub.stop(wanted),
            command.Follow: lambda wanted, identity: self._done(self._follow(wanted, identity)),
            command.Unfollow: lambda wanted, _: self._done(self._unfollow(wanted)),
        }
        """Commands of a subject that mean something else, or more, in the studio."""

    # ------------------------------------------------------------------ requests

    def receive(self, text: str, now: Nanos) -> str:
        """The one answer to a request. ``now`` is a moment of the wall clock."""
        self._now = now
        return json.dumps(self.answer(text, now), separators=(",", ":"))

    def answer(self, text: str, now: Nanos) -> Message:
        """As `receive`, as a value."""
        self._now = now
        if self.is_rest:
            self._hub.asked(self.viewer, now)
        data = text.encode("utf-8", "replace")
        if len(data) > LONGEST_REQUEST:
            return failure(Misuse(f"a request has at most {LONGEST_REQUEST} bytes"))
        return respond(self._do, data, self._hub.around.on_internal, self._read)

    def _read(self, message: Message) -> Wanted:
        """Raises `Misuse`, and `Refusal` for too many."""
        name = str(message["do"])
        if not (self._stops if name in STOPS else self._limit).allows(self._now):
            raise Refusal(f"too many requests: permitted are {RATE:g} a second")
        check_name(name)
        fields = fields_of(message)
        row = REQUESTS.get(name)
        if row is not None:
            request = read_request(row, fields)
            return Wanted(name, fields, lambda _: self._done(self._own[type(request)](request)))
        wanted = read_command(name, fields)
        return Wanted(name, fields, lambda identity: self._command(wanted, identity))

    def _command(self, wanted: Command, identity: Identity) -> Result:
        action = self._of_subject.get(type(wanted))
        return self._hub.subject.do(wanted) if action is None else action(wanted, identity)

    def _done(self, value: object) -> Result:
        """The result of what the subject knows nothing of."""
        return self._hub.subject.do(command.Time())._replace(value=value)

    def _do(self, wanted: Wanted, identity: Identity) -> Result:
        name = wanted.name
        if not self.has_entered and name not in STOPS and name != "hello":
            raise Refusal(f"{name}: the first request is hello")
        if self.is_rest and name in OF_CONNECTION:
            raise Refusal(f"{name} is about a connection: ask it over the WebSocket")
        permit = permit_of(name)
        try:
            result = self._permitted(wanted, permit, identity)
        except Exception as error:
            self._audit(wanted, permit, _outcome(error))
            raise
        self._audit(wanted, permit, "done")
        return result

    def _permitted(self, wanted: Wanted, permit: Permit, identity: Identity) -> Result:
        takes = check(wanted.name, permit, self.viewer, self._hub.control)
        result = wanted.act(identity)
        if takes and not self.is_rest:
            self._hub.take_control(self.viewer, over=False)
        return result

    def _audit(self, wanted: Wanted, permit: Permit, outcome: str) -> None:
        """Who looks is not recorded, and a jog once."""
        if (permit == LOOK and wanted.name not in STOPS) or (wanted.name == "renew" and outcome == "done"):
            return
        around = self._hub.around
        around.audit.add(self.viewer, around.moment().time, wanted.name, wanted.fields, outcome)

    # ------------------------------------------------------------------ who it is

    def _hello(self, wanted: ask.Hello) -> object:
        if self.has_entered:
            raise Misuse("hello: this connection has said hello already; resync asks for the state again")
        try:
            role, of_token = self._hub.around.gate.enter(wanted.token)
        except Refusal:
            self.is_refused = True
            raise
        name = (wanted.name or of_token or f"viewer {self.viewer.number}")[:LONGEST_NAME]
        viewer = Viewer(self.viewer.number, name, role)
        self._hub.join(viewer)
        self.viewer, self.has_entered, self._needs_hello = viewer, True, True
        return {"viewer": viewer.number, "name": name, "role": role.title}

    def _resync(self, _: ask.Resync) -> None:
        self._needs_hello = True

    def close(self) -> None:
        """The connection has ended."""
        for number in list(self._watches):
            self._hub.watches.remove(self._watches.pop(number))
        if self._place is not None:
            self._hub.streams.leave(self._place)
            self._place = None
        if self.has_entered and not self.is_rest:
            self._hub.leave(self.viewer)
        self.has_entered = False

    # ------------------------------------------------------------------ what it is sent

    def _watch(self, wanted: ask.Watch) -> object:
        if len(self._watches) >= MOST_WATCHES:
            raise Misuse(f"watch: there are {MOST_WATCHES} already, which is the most")
        if sum(len(one.values.points) for one in self._watches.values()) + len(wanted.points) > MOST_WATCHED:
            raise Misuse(f"watch: more than {MOST_WATCHED} points in all")
        readings = self._hub.read(wanted.points)
        number = next(self._watch_numbers)
        self._watches[number] = self._hub.watches.add(number, readings, wanted.rate)
        return {"watch": number, "points": [{"point": one.point, "unit": one.unit} for one in readings]}

    def _unwatch(self, wanted: ask.Unwatch) -> None:
        watched = self._watches.pop(wanted.watch, None)
        if watched is None:
            raise Misuse(f"unwatch: no watch {wanted.watch}; there are {', '.join(map(str, self._watches)) or 'none'}")
        self._hub.watches.remove(watched)

    def _follow(self, wanted: command.Follow, identity: Identity) -> object:
        if identity is None:
            raise Misuse("follow: give an id, by which it is ended")
        if identity in self._follows:
            raise Misuse(f"follow: the id {identity!r} is in use")
        if len(self._follows) >= MOST_FOLLOWS:
            raise Misuse(f"follow: there are {MOST_FOLLOWS} already, which is the most")
        what = filter_of(wanted.kinds, wanted.machines, wanted.axes)
        plans = [plan.plain() for plan in self._hub.subject.plans(what)]
        self._follows[identity] = what, wanted.bound
        self._move()
        return {"plans": plans}

    def _unfollow(self, wanted: command.Unfollow) -> None:
        if self._follows.pop(wanted.id, None) is None:
            raise Misuse(f"no subscription has the id {wanted.id!r}")
        self._move()

    def _move(self) -> None:
        """To the stream of what is followed now."""
        streams = self._hub.streams
        streams.flush()
        before, self._place = self._place, None
        if self._follows:
            filters = [what for what, _ in self._follows.values()]
            self._place = streams.enter(filters, max(bound for _, bound in self._follows.values()))
        if before is not None:
            self._left_over.append(before.take())
            streams.leave(before)
        if len(self._left_over) > MOST_LEFT_OVER:
            dropped = self._left_over.pop(0)
            self._missed += dropped.count + dropped.missed

    def has_news(self, now: Nanos) -> bool:
        """Whether `take` gives something."""
        if not self.has_entered or self.is_rest:
            return False
        return self._needs_hello or self._has_changes() or self._has_events(now) or self._has_values(now)

    def _has_changes(self) -> bool:
        return any(shared.version != self._seen.get(name) for name, shared in self._hub.shared.items())

    def _has_events(self, now: Nanos) -> bool:
        waiting = any(map(any, self._left_over)) or self._missed > 0 or (self._place is not None and self._place.has_news)
        return waiting and now >= self._events_due

    def _has_values(self, now: Nanos) -> bool:
        return any(watched.is_due(now) for watched in self._watches.values())

    def take(self, now: Nanos) -> list[str]:
        """What is to be sent now. Call it when what it gave last has been sent."""
        if not self.has_entered or self.is_rest:
            return []
        found: list[str] = []
        if self._needs_hello:
            found.append(self._whole())
        for name, shared in self._hub.shared.items():
            if shared.version != self._seen.get(name):
                self._seen[name] = shared.version
                found.append(f'{{"seq":{next(self._seq)},"{name}":{shared.text}}}')
        time = self._hub.around.moment().time if self._watches or self._place or self._left_over else 0
        if self._has_values(now):
            parts = [f'"{one.number}":{one.take(now)}' for one in self._watches.values() if one.is_due(now)]
            found.append(f'{{"seq":{next(self._seq)},"time_ns":"{time}","values":{{{",".join(parts)}}}}}')
        if self._has_events(now):
            found.append(self._events(now, time))
        return found

    def _events(self, now: Nanos, time: Nanos) -> str:
        self._events_due = now + EVENTS_NS
        batches, missed = self._left_over, self._missed
        self._left_over, self._missed = [], 0
        if self._place is not None:
            batches.append(self._place.take())
        text = ",".join(batch.text for batch in batches if batch.text)
        missed += sum(batch.missed for batch in batches)
        return f'{{"seq":{next(self._seq)},"time_ns":"{time}","events":[{text}],"missed":{missed}}}'

    def _whole(self) -> str:
        """The message hello; whatever was to be sent before is in it."""
        hub, viewer = self._hub, self.viewer
        self._needs_hello = False
        self._seq = count(1)
        self._seen = {name: shared.version for name, shared in hub.shared.items()}
        for watched in self._watches.values():
            watched.forget()
        present, number = hub.present()
        if self._place is not None:
            self._place.take()
        self._left_over, self._missed = [], 0
        moment = hub.around.moment()
        whole = {
            "version": VERSION,
            "program": hub.around.program,
            "viewer": viewer.number,
            "name": viewer.name,
            "role": viewer.role.title,
            "may": hub.may(viewer.role),
            "control": hub.holder(),
            "viewers": len(hub.viewers),
            "leases": hub.leases(),
            "number": number,
            "time_ns": str(moment.time),
            "pace": {key: value for key, value in moment.plain().items() if key != "time_ns"},
            "virtual": hub.around.virtual,
            **present,
        }
        text = json.dumps(whole, separators=(",", ":"))
        return f'{{"seq":0,"hello":{text[:-1]},"description":{hub.description}}}}}'


def _outcome(error: Exception) -> str:
    code = failure(error)["error"]
    return str(code["code"]) if isinstance(code, dict) else "internal"
