"""The session of one viewer: answers to its requests, and the messages to send when its connection accepts them.

Nothing waits here but places in streams and numbers of versions: a viewer that reads slowly gets the present, and less of the
past. The answer of a world is there at once, that of a device later: both are a `Later`.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Awaitable, Callable, Mapping
from inspect import isawaitable
from itertools import count
from typing import Any, ClassVar, NamedTuple, TypeAlias

from steptwin.access.control import Viewer, check
from steptwin.access.rate import RateLimit
from steptwin.access.roles import LOOK, Permit, Role
from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.jsonvalues import to_json
from steptwin.later import Later, start
from steptwin.messages import NONE, Message
from steptwin.studio import branchrequests as branch
from steptwin.studio import campaignrequests as campaign
from steptwin.studio import devicerequests as device
from steptwin.studio import drawingrequests as drawing
from steptwin.studio import recordingrequests as recording
from steptwin.studio import requests as ask
from steptwin.studio import servicerequests as services
from steptwin.studio import toolrequests as tool
from steptwin.studio import workrequests as work
from steptwin.studio.calculations import gear
from steptwin.studio.hub import Hub
from steptwin.studio.programs import ProgramTexts
from steptwin.studio.requests import IN_THE_PAST, OF_CONNECTION, REQUESTS, WITH_TOKEN, permit_of, request_called
from steptwin.studio.streams import MOST_WAITING, Batch, StreamPosition
from steptwin.studio.timetravel import OF_A_MOMENT, ShownMoment
from steptwin.studio.watches import Watched
from steptwin.subject import commands as command
from steptwin.subject.commands import VERSION, Command
from steptwin.subject.contract import Result
from steptwin.subject.dispatch import LONGEST_REQUEST, JsonObject, answer, code_of, failure, fields_of, id_of, read_message
from steptwin.subject.subscriptions import Filter, filter_of
from steptwin.tables import complete
from steptwin.wire.pcapng import capture

RATE, BURST = 200.0, 1000.0
"""Rate limit of a viewer: requests per second, and burst; stops have a separate limit of the same size."""
STOPS = frozenset({"stop", "stop_all"})
"""Requests that need no hello, and have a limit of their own."""
MOST_WATCHES = 32
MOST_WATCHED = 2000
"""Limit of watched points of a viewer."""
MOST_SUBSCRIPTIONS = 16
EVENTS_NS: Nanos = SECOND // 30
"""Events are sent at most this often."""
LONGEST_NAME = 40

Identity: TypeAlias = object
MOST_LEFT_OVER = 4
"""Limit of batches of events that were pending when the subscribed kinds changed."""


class Wanted(NamedTuple):
    """A parsed request."""

    name: str
    fields: Mapping[str, object]
    request: ask.StudioRequest | Command


TOO_MANY_REQUESTS = Message("studio.too-many-requests", "too many requests: permitted are {rate:g} a second")
REQUEST_TOO_LONG = Message("studio.request-too-long", "a request has at most {most} bytes")
HELLO_WITHOUT_VERSION = Message(
    "studio.hello-without-version",
    "hello: version is missing, as in version 1 of the protocol: this studio has version {own}",
)
HELLO_IS_FIRST_REQUEST = Message("studio.hello-is-first-request", "{request}: the first request is hello")
NEEDS_A_TOKEN = Message("studio.needs-a-token", "{request} needs the token of this studio, which is in its file of tokens")
ABOUT_A_CONNECTION = Message("studio.about-a-connection", "{request} is about a connection: ask it over the WebSocket")
PAST_CANNOT_BE_CHANGED = Message(
    "studio.past-cannot-be-changed", "{request}: the past cannot be changed: return to the present first"
)
SECOND_HELLO = Message("studio.second-hello", "hello: this connection has said hello already; resync asks for the state again")
TOO_MANY_WATCHES = Message("studio.too-many-watches", "watch: too many: the limit is {most}; end one")
TOO_MANY_WATCHED_POINTS = Message("studio.too-many-watched-points", "watch: more than {most} points in all")
UNKNOWN_WATCH = Message("studio.unknown-watch", "unwatch: no watch {number}; there are {names}")
SUBSCRIPTION_WITHOUT_ID = Message("studio.subscription-without-id", "subscribe: give an id, by which it is ended")
SUBSCRIPTION_ID_IN_USE = Message("studio.subscription-id-in-use", "subscribe: the id {id!r} is in use")
TOO_MANY_SUBSCRIPTIONS = Message("studio.too-many-subscriptions", "subscribe: too many: the limit is {most}; end one")
UNKNOWN_SUBSCRIPTION = Message("studio.unknown-subscription", "no subscription has the id {id!r}")


class ViewerSession:
    """The session of a connection, or of a client of REST (``is_rest``), whose viewer ``entered`` exists from the beginning.

    ``has_token``: whether that client has given a token.
    """

    def __init__(self, hub: Hub, peer: str, *, entered: Viewer | None = None, has_token: bool = False) -> None:
        self._hub = hub
        self._peer = peer
        self.is_rest = entered is not None
        self.viewer = entered or Viewer(hub.number(), peer, Role.VIEWER)
        """Before its hello: a viewer with the lowest role that is not listed."""
        self.has_entered = self.is_rest
        """Whether it has sent hello."""
        self._has_token = has_token
        self._is_refused = False
        """Whether it has given a wrong token."""
        self._limit = RateLimit(RATE, BURST)
        self._stops = RateLimit(RATE, BURST)
        self._seq = count()
        self._needs_hello = False
        self._descriptions = hub.descriptions
        self._seen = 0
        """The last change of shared parts that it was sent."""
        self._watches: dict[int, Watched] = {}
        self._watch_numbers = count(1)
        self._follows: dict[object, tuple[Filter, int]] = {}
        """By the id of the request; that of hello by the session, as it has no end."""
        self._place: StreamPosition | None = None
        self._left_over: list[Batch] = []
        """Pending events from before the last change of the followed kinds."""
        self._missed = 0
        self._events_due: Nanos = 0
        self._now: Nanos = 0
        self._shown_moment = ShownMoment(hub.around.time_travel)
        self._of_subject: Mapping[object, Callable[[Any, Identity], Awaitable[Result]]] = {
            command.Jog: lambda wanted, _: self._jog(wanted),
            command.StopAxes: lambda wanted, _: hub.stop(wanted),
            command.StopAll: lambda _wanted, _: hub.stop_all(),
            command.Save: lambda wanted, _: hub.subject.do(command.Save(hub.recording_files.place(wanted.file))),
            command.Subscribe: self._subscribe,
            command.Unsubscribe: lambda wanted, _: self._unsubscribe(wanted),
        }
        """Commands of a subject that mean something else, or more, in the studio."""

    @property
    def is_refused(self) -> bool:
        """Whether the connection must be closed for want of a token, which may be asked for only since it was opened."""
        return self._is_refused or (self.has_entered and not self._has_token and self._hub.around.gate.asks)

    @property
    def with_token(self) -> list[str]:
        """Names of requests for which this viewer would have to give a token."""
        if self._has_token or not self._hub.around.gate.has_tokens:
            return []
        return [name for name in REQUESTS if name in WITH_TOKEN]

    # ------------------------------------------------------------------ requests

    def receive(self, text: str, now: Nanos) -> Later[JsonObject]:
        """The answer to a request. ``now``: a moment of the wall clock."""
        self._now = now
        if self.is_rest:
            self._hub.asked(self.viewer, now)
        data = text.encode("utf-8", "replace")
        return start(self._answer(data))

    async def _answer(self, data: bytes) -> JsonObject:
        found: JsonObject = {}
        try:
            if len(data) > LONGEST_REQUEST:
                raise Misuse(REQUEST_TOO_LONG(most=LONGEST_REQUEST))
            message = read_message(data)
            identity = id_of(message)
            found = {} if identity is None else {"id": identity}
            return {**found, **answer(await self._do(self._read(message), identity))}
        except Exception as error:  # noqa: BLE001  every request gets an answer
            if not isinstance(error, SteptwinError):
                self._hub.around.on_internal(error)
            return {**found, **failure(error)}

    def _read(self, message: JsonObject) -> Wanted:
        """Raises `Misuse`, and `Refusal` for too many."""
        name = str(message["do"])
        if not (self._stops if name in STOPS else self._limit).allows(self._now):
            raise Refusal(TOO_MANY_REQUESTS(rate=RATE))
        kind = request_called(name)
        fields = fields_of(message)
        if name == "hello" and "version" not in message:
            raise Misuse(HELLO_WITHOUT_VERSION(own=VERSION))
        return Wanted(name, fields, kind.read(fields))

    async def _act(self, wanted: Any, identity: Identity) -> Result:
        """Execute a request, or a command of the subject."""
        own = self._ACTIONS.get(type(wanted))
        if own is not None:
            value = own(self, wanted)
            return self._hub.subject.result_of(to_json(await value if isawaitable(value) else value))
        if type(wanted) in OF_A_MOMENT and self._shown_moment.is_past:
            return await self._shown_moment.do(wanted)
        action = self._of_subject.get(type(wanted))
        return await (self._hub.subject.do(wanted) if action is None else action(wanted, identity))

    async def _connect(self, wanted: ask.Connect) -> ask.ConnectedDevice:
        return ask.ConnectedDevice(await self._hub.connections.connect(wanted.address, wanted.name))

    async def _read_settings(self, wanted: device.ReadSettings) -> device.DeviceSettings:
        return device.DeviceSettings(wanted.controller, await self._hub.connections.settings(wanted.controller))

    async def _view_recording(self, wanted: recording.ViewRecording) -> recording.ViewAddress:
        return recording.ViewAddress(await self._hub.recording_files.view(wanted.name))

    async def _jog(self, wanted: command.Jog) -> Result:
        return self._hub.subject.result_of(to_json(await self._hub.begin_jog(self.viewer, wanted)))

    async def _do(self, wanted: Wanted, identity: Identity) -> Result:
        name = wanted.name
        if not self.has_entered and name not in STOPS and name != "hello":
            raise Refusal(HELLO_IS_FIRST_REQUEST(request=name))
        if self.is_refused and name not in STOPS:
            self._hub.around.gate.enter(None)
        if name in WITH_TOKEN and name in self.with_token:
            raise Refusal(NEEDS_A_TOKEN(request=name))
        if self.is_rest and name in OF_CONNECTION:
            raise Refusal(ABOUT_A_CONNECTION(request=name))
        permit = permit_of(name)
        try:
            result = await self._permitted(wanted, permit, identity)
        except Exception as error:
            self._audit(wanted, permit, code_of(error))
            raise
        self._audit(wanted, permit, "done")
        return result

    async def _permitted(self, wanted: Wanted, permit: Permit, identity: Identity) -> Result:
        hub = self._hub
        if self._shown_moment.is_past and permit.control and wanted.name not in IN_THE_PAST:
            raise Refusal(PAST_CANNOT_BE_CHANGED(request=wanted.name))
        takes = check(wanted.name, permit, self.viewer, hub.control) and not self.is_rest
        if takes:
            hub.control.take(self.viewer, over=False)  # so that no other viewer acts while a device is asked
        try:
            result = await self._act(wanted.request, identity)
        except Exception:
            if takes:
                hub.control.release(self.viewer)
            raise
        if takes and hub.control.holder is self.viewer:
            hub.take_control(self.viewer, over=False)
        return result

    def _audit(self, wanted: Wanted, permit: Permit, outcome: str) -> None:
        """Who looks is not recorded, and a jog once."""
        if (permit == LOOK and wanted.name not in STOPS) or (wanted.name == "renew" and outcome == "done"):
            return
        around = self._hub.around
        around.audit.add(self.viewer, around.moment().time, wanted.name, wanted.fields, outcome)

    # ------------------------------------------------------------------ identity of the viewer

    def _hello(self, wanted: ask.Hello) -> ask.EnteredViewer:
        if self.has_entered:
            raise Misuse(SECOND_HELLO())
        try:
            role, of_token = self._hub.around.gate.enter(wanted.token)
        except Refusal:
            self._is_refused = True
            raise
        self._has_token = of_token is not None
        name = (wanted.name or of_token or f"viewer {self.viewer.number}")[:LONGEST_NAME]
        viewer = Viewer(self.viewer.number, name, role)
        self._hub.join(viewer)
        self.viewer, self.has_entered, self._needs_hello = viewer, True, True
        if wanted.kinds is not None:
            self._follows[self] = filter_of(wanted.kinds), MOST_WAITING
            self._move()
        return ask.EnteredViewer(viewer.number, name, role.title)

    def _resync(self, _: ask.Resync) -> None:
        self._needs_hello = True

    def close(self) -> None:
        """End the session after the connection has ended."""
        for number in list(self._watches):
            self._hub.watches.remove(self._watches.pop(number))
        if self._place is not None:
            self._hub.streams.leave(self._place)
            self._place = None
        if self.has_entered and not self.is_rest:
            self._hub.leave(self.viewer)
        self._shown_moment.leave()
        self.has_entered = False

    # ------------------------------------------------------------------ the past

    async def _look_at(self, wanted: ask.ShowMoment) -> object:
        if wanted.moment is not None:
            return await self._shown_moment.go(wanted.moment, self._watches)
        if self._shown_moment.is_past:
            self._shown_moment.leave()
            self._forget_values()
        return None

    async def _go_back(self, _: ask.GoBack) -> None:
        await self._shown_moment.go_back()
        self._forget_values()

    def _forget_values(self) -> None:
        """The viewer has none of what it watches."""
        for watched in self._watches.values():
            watched.forget()

    async def _programs(self) -> ProgramTexts:
        return await self._shown_moment.programs() if self._shown_moment.is_past else self._hub.around.programs

    async def _list_programs(self, _: ask.ListPrograms) -> object:
        return (await self._programs()).list()

    async def _read_program(self, wanted: ask.ReadProgram) -> object:
        return (await self._programs()).text(wanted.controller, wanted.place)

    async def _read_memory(self, wanted: ask.ReadMemory) -> object:
        return (await self._programs()).memory(wanted.controller, wanted.place, wanted.text)

    # ------------------------------------------------------------------ what it is sent

    def _watch(self, wanted: ask.WatchPoints) -> ask.Watch:
        if len(self._watches) >= MOST_WATCHES:
            raise Misuse(TOO_MANY_WATCHES(most=MOST_WATCHES))
        if sum(len(one.values.points) for one in self._watches.values()) + len(wanted.points) > MOST_WATCHED:
            raise Misuse(TOO_MANY_WATCHED_POINTS(most=MOST_WATCHED))
        readings = self._hub.read(wanted.points)
        number = next(self._watch_numbers)
        self._watches[number] = self._hub.watches.add(number, readings, wanted.rate)
        if self._shown_moment.is_past:
            self._shown_moment.unsent.add(number)
        return ask.Watch(number, tuple([ask.WatchedPoint(one.point, one.unit) for one in readings]))

    def _unwatch(self, wanted: ask.Unwatch) -> None:
        watched = self._watches.pop(wanted.watch, None)
        if watched is None:
            raise Misuse(UNKNOWN_WATCH(number=wanted.watch, names=list(self._watches) or NONE()))
        self._hub.watches.remove(watched)

    async def _subscribe(self, wanted: command.Subscribe, identity: Identity) -> Result:
        if identity is None:
            raise Misuse(SUBSCRIPTION_WITHOUT_ID())
        if identity in self._follows:
            raise Misuse(SUBSCRIPTION_ID_IN_USE(id=identity))
        if len(self._follows) >= MOST_SUBSCRIPTIONS:
            raise Misuse(TOO_MANY_SUBSCRIPTIONS(most=MOST_SUBSCRIPTIONS))
        what = filter_of(wanted.kinds, wanted.controllers, wanted.axes)
        plans = [plan.to_json() for plan in self._hub.subject.plans(what)]
        self._follows[identity] = what, wanted.bound
        self._move()
        return self._hub.subject.result_of({"plans": plans})

    async def _unsubscribe(self, wanted: command.Unsubscribe) -> Result:
        if self._follows.pop(wanted.id, None) is None:
            raise Misuse(UNKNOWN_SUBSCRIPTION(id=wanted.id))
        self._move()
        return self._hub.subject.result_of(None)

    def _move(self) -> None:
        """To the stream of what the viewer subscribes to now."""
        streams = self._hub.streams
        streams.flush()
        before, self._place = self._place, None
        if self._follows:
            filters = [what for what, _ in self._follows.values()]
            self._place = streams.enter(filters, max(bound for _, bound in self._follows.values()))
        if before is not None:
            batch = before.take()
            if batch.count or batch.missed:
                self._left_over.append(batch)
            streams.leave(before)
        if len(self._left_over) > MOST_LEFT_OVER:
            dropped = self._left_over.pop(0)
            self._missed += dropped.count + dropped.missed

    def take(self, now: Nanos) -> list[str]:
        """The messages to send now, often none. Must be called only after the previous ones were sent."""
        if not self.has_entered or self.is_rest:
            return []
        hub = self._hub
        found: list[str] = []
        if self._needs_hello or self._descriptions != hub.descriptions:  # it was asked for, or there are other controllers
            found.append(self._whole())
        if self._seen != hub.shared.changes:
            parts = hub.shared.since(self._seen)
            self._seen = hub.shared.changes
            found += [f'{{"seq":{next(self._seq)},"{name}":{text}}}' for name, text in parts]
        if self._shown_moment.is_changed:
            found.append(self._past())
        values = ",".join([f'"{number}":{text}' for number, text in self._take_values(now)])
        if values:
            found.append(f'{{"seq":{next(self._seq)},"time_ns":"{hub.time(now)}","values":{{{values}}}}}')
        if now >= self._events_due and self._has_events():
            found.append(self._events(now))
        return found

    def _has_events(self) -> bool:
        return bool(self._left_over) or self._missed > 0 or (self._place is not None and self._place.has_news)

    def _take_values(self, now: Nanos) -> list[tuple[int, str]]:
        if self._shown_moment.is_past:
            return list(self._shown_moment.take(self._watches).items())
        return [(one.number, one.take(now)) for one in self._watches.values() if one.is_due(now)]

    def _may(self) -> list[str]:
        """Names of requests that this viewer may use here."""
        needing = self.with_token
        return [name for name in self._hub.may(self.viewer.role) if name not in needing]

    def _past(self) -> str:
        may = [name for name in self._may() if name in IN_THE_PAST or not permit_of(name).control]
        return json.dumps({"seq": next(self._seq), "past": self._shown_moment.message(may)}, separators=(",", ":"))

    def _events(self, now: Nanos) -> str:
        self._events_due = max(self._events_due + EVENTS_NS, now + EVENTS_NS // 2)
        batches, missed = self._left_over, self._missed
        self._left_over, self._missed = [], 0
        if self._place is not None:
            batches.append(self._place.take())
        text = ",".join(batch.text for batch in batches if batch.text)
        missed += sum(batch.missed for batch in batches)
        return f'{{"seq":{next(self._seq)},"time_ns":"{self._hub.time(now)}","events":[{text}],"missed":{missed}}}'

    def _whole(self) -> str:
        """The message hello; whatever was to be sent before is in it."""
        hub, viewer = self._hub, self.viewer
        self._needs_hello = False
        self._descriptions = hub.descriptions
        self._seq = count(1)
        self._seen = hub.shared.changes
        self._forget_values()
        if self._shown_moment.is_past:
            self._shown_moment.is_changed, self._shown_moment.unsent = True, set(self._watches)
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
            "may": self._may(),
            "with_token": self.with_token,
            "control": hub.holder(),
            "viewers": len(hub.viewers),
            "leases": hub.leases(),
            "number": number,
            "time_ns": str(moment.time),
            "pace": {key: value for key, value in moment.to_json().items() if key != "time_ns"},
            "virtual": hub.is_virtual,
            "device_kinds": [] if hub.around.connections is None else list(hub.around.connections.kinds),
            **present,
        }
        text = json.dumps(whole, separators=(",", ":"))
        return f'{{"seq":0,"hello":{text[:-1]},"description":{hub.description}}}}}'

    _ACTIONS: ClassVar[Mapping[object, Callable[[Any, Any], object]]] = complete(
        "request",
        [row.kind for row in REQUESTS.values()],
        "action",
        {
            ask.Hello: _hello,
            ask.Resync: _resync,
            ask.WatchPoints: _watch,
            ask.Unwatch: _unwatch,
            ask.TakeControl: lambda self, wanted: self._hub.take_control(self.viewer, over=wanted.over),
            ask.ReleaseControl: lambda self, _: self._hub.release_control(self.viewer),
            ask.Renew: lambda self, wanted: self._hub.renew(self.viewer, wanted.lease),
            ask.LetGo: lambda self, wanted: self._hub.let_go(self.viewer, wanted.lease),
            ask.ShowMoment: _look_at,
            ask.GoBack: _go_back,
            ask.ReadPastEvents: lambda self, one: self._shown_moment.events(one.begin, one.end, one.kinds),
            ask.ListPrograms: _list_programs,
            ask.ReadProgram: _read_program,
            ask.ReadMemory: _read_memory,
            ask.ListPorts: lambda self, _: self._hub.connections.ports(),
            ask.Connect: _connect,
            ask.Disconnect: lambda self, wanted: self._hub.connections.disconnect(wanted.controller),
            ask.ReadTraffic: lambda self, _: self._hub.traffic(),
            ask.ReadAudit: lambda self, wanted: self._hub.around.audit.last(wanted.most),
            tool.ReadConfiguration: lambda self, wanted: self._hub.configurations.read(wanted.controller),
            tool.EditConfiguration: lambda self, one: self._hub.configurations.edit(one.controller, one.text, one.changes),
            tool.ReadQuantities: lambda self, wanted: self._hub.calculations.quantities(wanted.controller, wanted.axis),
            tool.Calculate: lambda self, one: self._hub.calculations.calculate(one.controller, one.axis, one.given, one.find),
            tool.ConvertGear: lambda _, one: gear(one.motor_steps, one.microsteps, one.ratio, one.lead),
            tool.MakeCapture: lambda _, one: tool.CaptureFile(b64encode(b"".join(capture(one.frames))).decode("ascii")),
            device.ReadSettings: _read_settings,
            device.ReadDigitalShadow: lambda self, wanted: self._hub.connections.shadow_of(wanted.controller, wanted.after),
            device.SetDigitalShadow: lambda self, wanted: self._hub.connections.shadow(wanted.controller, on=wanted.on),
            recording.ReadRecordings: lambda self, _: self._hub.recordings.list(),
            recording.SaveRecording: lambda self, wanted: self._hub.recordings.save(wanted.name),
            recording.ViewRecording: _view_recording,
            branch.ListBranches: lambda self, _: self._hub.branches.list(),
            branch.StartBranch: lambda self, wanted: self._hub.branches.start(wanted.moment),
            branch.EndBranch: lambda self, wanted: self._hub.branches.end(wanted.branch),
            branch.ShowBranch: lambda self, wanted: self._hub.show_branch(wanted.branch),
            branch.LeaveWorld: lambda self, _: self._hub.leave_world(),
            services.ReadGateways: lambda self, _: self._hub.services.gateways(),
            services.ReadHistory: lambda self, _: self._hub.services.history(),
            services.ReadHistoryValues: lambda self, one: self._hub.services.values(one.points, one.run, one.from_s, one.to_s),
            services.ReadHistoryWrites: lambda self, one: self._hub.services.writes(one.run, one.from_s, one.to_s),
            services.CompareHistory: lambda self, one: self._hub.services.compare(
                one.points, (one.run, one.other), one.from_s, one.to_s
            ),
            campaign.ListCampaigns: lambda self, _: self._hub.campaigns.list(),
            campaign.RunCampaign: lambda self, wanted: self._hub.campaigns.run(wanted.campaign),
            campaign.EndCampaign: lambda self, wanted: self._hub.campaigns.end(wanted.campaign),
            campaign.ChangeCampaign: lambda self, wanted: self._hub.campaign_texts.change(wanted.campaign, wanted.text),
            drawing.ReadDrawing: lambda self, _: self._hub.arrangement.drawing(),
            drawing.SaveDrawing: lambda self, wanted: self._hub.arrangement.save(wanted.places),
            drawing.Place: lambda self, one: self._hub.arrangement.place(one.name, one.at, write=one.write),
            work.Scan: lambda self, one: self._hub.work.scan(one.places, one.kind, one.units, one.baud, one.timeout),
            work.Verify: lambda self, wanted: self._hub.work.verify(wanted.address, write=wanted.write),
            work.ReadWork: lambda self, _: self._hub.work.last,
            work.CancelWork: lambda self, _: self._hub.work.cancel(),
        },
    )
    """Actions of the requests of the studio, by class. The answer of one that asks a subject may come later."""
