"""Channels of PV Access: the fields of records as normative types (NTScalar, NTEnum), one channel for each of a client.

The library calls from threads of its own, which must not wait: everything is done in the event loop of the gateway. So is a put,
whose answer comes when what follows from it is over, unless its request has ``record[block=false]``.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, NamedTuple

from p4p import Type, Value
from p4p.nt import NTEnum, NTScalar
from p4p.server import DynamicProvider
from p4p.server.raw import SharedPV

from steptwin.errors import Misuse, SteptwinError
from steptwin.gateways.epics.records import (
    AlarmKind,
    FieldQuantity,
    FieldRow,
    FieldType,
    FieldValue,
    Putter,
    Record,
    check_state,
    ends_of,
    found_field,
    is_same,
)

_TYPES: dict[FieldType, Type] = {
    FieldType.DOUBLE: NTScalar.buildType("d", display=True, control=True, form=True),
    FieldType.LONG: NTScalar.buildType("i", display=True, control=True, form=True),
    FieldType.SHORT: NTScalar.buildType("h", display=True, control=True, form=True),
    FieldType.STRING: NTScalar.buildType("s", display=True),
    FieldType.STATES: NTEnum.buildType(extra=[("display", ("S", None, [("description", "s")]))]),
}
_STATUS = {AlarmKind.NO_ALARM: 0, AlarmKind.STATE: 1, AlarmKind.HIGH: 1, AlarmKind.COMM: 2, AlarmKind.UDF: 6}
"""Status of alarm_t: none, device, driver, undefined."""
_FORMS = ("Default", "String", "Binary", "Decimal", "Hex", "Exponential", "Engineering")
"""Choices of ``display.form``."""
_NANO = 1_000_000_000


class _ShownField(NamedTuple):
    """Changing values that clients of a channel see."""

    value: FieldValue
    status: int
    severity: int
    message: str
    limits: tuple[float, float]


class PvChannel:
    """The channel of one client to a field. A `FieldChannel`; as the circuit of a `Putter` its text is the address.

    Made by a thread of the library. `begin` and `end` belong to the event loop.
    """

    def __init__(self, provider: RecordProvider, name: str, found: tuple[Record, FieldRow], peer: str) -> None:
        self.name = name
        self.account = ""
        """Account of the client, as it says itself; known after its first put."""
        record, row = found
        self._provider = provider
        self._record = record
        self._row = row
        self._peer = peer
        self._shown: _ShownField | None = None
        self.pv = SharedPV(handler=self)

    def __str__(self) -> str:
        return self._peer

    # ------------------------------------------------------------------ called by threads of the library

    def put(self, _: SharedPV, operation: Any) -> None:
        self._provider.call(self._put, operation)

    def onLastDisconnect(self, _: SharedPV) -> None:  # noqa: N802  the library's name
        self._provider.call(self.end)

    # ------------------------------------------------------------------ in the event loop

    async def begin(self) -> None:
        self._record.attach(self._row.name, self)  # a record is only kept up to date for those who ask for it
        self._provider.channels.add(self)
        await self._record.refresh()
        self._shown = self._present()
        self.pv.open(self._value(self._shown, {**self._constants(), "display.description": self._row.meaning}))

    async def end(self) -> None:
        """Its client has gone."""
        self._record.detach(self._row.name, self)
        self._provider.channels.discard(self)
        self._provider.on_leave(self)

    async def show(self) -> None:
        now, before = self._present(), self._shown
        if before is None or (is_same(now.value, before.value) and now[1:] == before[1:]):
            return
        self._shown = now
        self.pv.post(self._value(now, {}))

    async def _put(self, operation: Any) -> None:
        is_answered = not _blocks(operation.pvRequest())
        if is_answered:
            operation.done()
        error: str | None = "internal error"
        try:
            self.account = operation.account()
            who = Putter(self.account, self._peer.rpartition(":")[0], self)
            await self._record.put(who, self._row.name, self._given(operation.value()))
            error = None
        except SteptwinError as refused:
            error = str(refused)
        finally:
            if not is_answered:
                operation.done(error=error)

    def _given(self, value: Value) -> FieldValue:
        """Raises `Misuse`."""
        row = self._row
        if not row.is_writable:
            raise Misuse(f"{row.name} cannot be put")
        name = "value.index" if row.type is FieldType.STATES else "value"
        if not value.changed(name):
            raise Misuse(f"{row.name}: the put has no value")
        given = value[name]
        return check_state(row, int(given)) if row.type is FieldType.STATES else given

    def _present(self) -> _ShownField:
        record, row = self._record, self._row
        kind, severity = record.alarm
        message = "" if kind is AlarmKind.NO_ALARM else kind.value
        return _ShownField(record.value(row.name), _STATUS[kind], severity.value, message, ends_of(record.limits_of(row)))

    def _value(self, shown: _ShownField, others: dict[str, Any]) -> Value:
        row = self._row
        seconds, nanoseconds = divmod(round(self._record.at_s * _NANO), _NANO)
        found = {
            **others,
            "value.index" if row.type is FieldType.STATES else "value": shown.value,
            "alarm.status": shown.status,
            "alarm.severity": shown.severity,
            "alarm.message": shown.message,
            "timeStamp.secondsPastEpoch": seconds,
            "timeStamp.nanoseconds": nanoseconds,
        }
        if _has_limits(row):
            for place in ("display", "control"):
                found |= {f"{place}.limitLow": shown.limits[0], f"{place}.limitHigh": shown.limits[1]}
        value = Value(_TYPES[row.type])
        for name, one in found.items():
            value[name] = one
        return value

    def _constants(self) -> dict[str, Any]:
        row = self._row
        if row.type is FieldType.STATES:
            return {"value.choices": list(row.states)}
        units = {"display.units": self._record.unit_of(row)}
        if row.type is FieldType.STRING:
            return units
        precision = self._record.precision if row.type is FieldType.DOUBLE else 0
        return {**units, "display.precision": precision, "display.form.choices": list(_FORMS)}


def _has_limits(row: FieldRow) -> bool:
    return row.quantity is not FieldQuantity.PURE and row.type not in (FieldType.STRING, FieldType.STATES)


def _blocks(request: Value) -> bool:
    """Whether a put waits for what follows from it."""
    options = request.todict().get("record", {}).get("_options", {})
    return str(options.get("block", True)).lower() not in ("false", "0")


class RecordProvider(DynamicProvider):
    """Gives clients channels to the fields of ``records``. ``on_leave`` is called with a channel whose client has gone."""

    def __init__(self, records: dict[str, Record], on_leave: Callable[[object], None]) -> None:
        super().__init__("steptwin", self)
        self.on_leave = on_leave
        self.channels: set[PvChannel] = set()
        """Those that clients have."""
        self._records = records
        self._loop = asyncio.get_running_loop()
        self._tasks: set[asyncio.Task[None]] = set()

    def call(self, act: Callable[..., Coroutine[Any, Any, None]], *arguments: Any) -> None:
        """Do something in the event loop; from any thread."""
        self._loop.call_soon_threadsafe(self._begin, act, arguments)

    def _begin(self, act: Callable[..., Coroutine[Any, Any, None]], arguments: tuple[Any, ...]) -> None:
        task = self._loop.create_task(act(*arguments))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """End what is being done."""
        for task in self._tasks:
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks)

    # ------------------------------------------------------------------ called by threads of the library

    def testChannel(self, name: str) -> bool:  # noqa: N802  the library's name
        try:
            found_field(self._records, name)
        except KeyError:
            return False
        return True

    def makeChannel(self, name: str, peer: str) -> SharedPV:  # noqa: N802  the library's name
        channel = PvChannel(self, name, found_field(self._records, name), peer)
        self.call(channel.begin)
        return channel.pv
