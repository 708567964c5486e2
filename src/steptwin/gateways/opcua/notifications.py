"""Events of the subject as events of OPC UA: reports of controllers, faults and notes, with the virtual time of each."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy

from asyncua import Server, ua
from asyncua.server.event_generator import EventGenerator

from steptwin.controller import SECOND
from steptwin.datasheet import EventSeverity
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.opcua.addressspace import NAMESPACE, node_id
from steptwin.gateways.opcua.nodetypes import standard
from steptwin.subject.events import Event
from steptwin.subject.payloads import StatusPayload
from steptwin.subject.subscriptions import Filter, Subscription

KINDS = frozenset({"status", "report", "note", "fault", "button"})
MOST_EVENTS = 4096
SEVERITIES: Mapping[EventSeverity, int] = {
    EventSeverity.INFORMATION: 100,
    EventSeverity.WARNING: 500,
    EventSeverity.ALARM: 800,
}
"""OPC 10000-5, 6.4.2: 1 to 1000."""
FIELDS = [
    ("Kind", ua.VariantType.String),
    ("Code", ua.VariantType.String),
    ("VirtualTime", ua.VariantType.Double),
    ("Number", ua.VariantType.Int64),
    ("Cause", ua.VariantType.Int64),
]
"""Fields of the type of event, besides those that every event has."""
SERVER = ""


class Notifications:
    """Events for clients that subscribe to the server, or to one controller."""

    def __init__(self, subject: GatewaySubject, subscription: Subscription, generators: Mapping[str, EventGenerator]) -> None:
        self._subscription = subscription
        self._generators = generators
        self._severities = {
            (part.name, event.code): SEVERITIES[event.severity]
            for part in subject.description.controllers
            for event in part.datasheet.events
        }

    @classmethod
    async def open(cls, server: Server, subject: GatewaySubject) -> Notifications:
        """Add the type of event to ``server``, which has the objects of the controllers already."""
        kind = await server.create_custom_event_type(NAMESPACE, "MachineEventType", ua.ObjectIds.BaseEventType, FIELDS)
        generators = {SERVER: await server.get_event_generator(kind)}
        for part in subject.description.controllers:
            event = copy(generators[SERVER].event)  # the library would collect its fields from the type again
            event.SourceNode, event.SourceName = None, None
            generators[part.name] = await server.get_event_generator(event, node_id(part.name))
        return cls(subject, subject.subscribe(Filter(KINDS), MOST_EVENTS), generators)

    def close(self) -> None:
        self._subscription.close()

    async def publish(self) -> None:
        missed, events = self._subscription.take()
        if missed:
            generator = self._generators[SERVER]
            generator.event.Severity = SEVERITIES[EventSeverity.WARNING]
            await generator.trigger(message=f"{missed} events were lost: more than {MOST_EVENTS} at once")
        for event in events:
            for name in (SERVER, event.controller):
                if name in self._generators:
                    await self._trigger(self._generators[name], event)

    async def _trigger(self, generator: EventGenerator, event: Event) -> None:
        code = event.payload.code if isinstance(event.payload, StatusPayload) else event.kind
        shown = generator.event
        shown.Severity = self._severities.get((event.controller, code), SEVERITIES[EventSeverity.INFORMATION])
        shown.SourceName = event.controller
        shown.SourceNode = node_id(event.controller) if event.controller in self._generators else standard(ua.ObjectIds.Server)
        shown.Kind = event.kind
        shown.Code = code
        shown.VirtualTime = event.time / SECOND
        shown.Number = event.number
        shown.Cause = event.cause or 0
        await generator.trigger(message=event.text)
