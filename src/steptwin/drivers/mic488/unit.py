"""One controller on a line: reading and writing values, and the state that drivers of the same controller share.

Suffixes: ``_u`` configured units, ``_p`` pulses, ``_ns`` nanoseconds, ``_s`` seconds.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Generator, Iterable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from types import MappingProxyType
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.exchange import Job, SentLate
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488.failures import ModbusRefusal, NotReady, Unconfirmed, unconfirmed
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.drivers.modbus import ModbusQuery, bits, words
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse
from steptwin.messages import Message, text_of
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.describe import AxisScale, Wording
from steptwin.mic488.registermap import DataType, RegisterMap, Type
from steptwin.mic488.registers import AXES
from steptwin.mic488.status import AxisStatus, ProgramState
from steptwin.mic488.values import (
    PROGRAM,
    Block,
    RegisterItem,
    RegisterValue,
    UserFormat,
    encoded,
    encoded_words,
    halted,
    moves,
    plan,
    repeatable,
    user_item,
)
from steptwin.wire import pdu

ALL_AXES = tuple(range(1, AXES + 1))
QUERIES_KEPT = 256
URGENT_TRIES = 5
"""Number of attempts for a stop."""
PATIENCE_NS: Nanos = 5 * SECOND
"""A request that changes something is sent at most this long after the call, ns."""

GEAR_IS_UNKNOWN = Message(
    "drivers.mic488.gear-is-unknown",
    "DATA_TYPE is DINT, so {name} takes pulses, and GEAR is not known: give the configuration, or set DATA_TYPE to REAL",
)
NO_DATA_TYPE = Message("drivers.mic488.no-data-type", "unit {unit} reads DATA_TYPE = {value}, which is not a value of a MIC488")
WAITS_FOR_TRIGGERS = Message(
    "drivers.mic488.waits-for-triggers",
    "unit {unit} is in TRIGGER mode (AXIS_CTR_MODE = 1), in which a motion waits for its trigger: set AXIS_CTR_MODE to 0",
)
IS_SWITCHED_OFF = Message(
    "drivers.mic488.is-switched-off", "M{axis} of unit {unit} is switched off: enable it first (M{axis}_EN = 1)"
)
TOO_LATE_AND_UNCONFIRMED = Message("drivers.mic488.too-late-and-unconfirmed", "a request was sent too late, and {problem}")


class ControlRegisters(NamedTuple):
    """The control registers, which show the state of the controller; ``at``: a moment (ns) before they were read."""

    at: Nanos
    data_type: DataType
    program: int
    """PROGRAM_CTRL: 0 stopped, 1 running, 2 paused."""
    triggered: bool
    """Whether AXIS_CTR_MODE is TRIGGER: motion registers then wait for their trigger."""
    controller: int | None
    """M_STATUS, None where the firmware has none."""
    axes: tuple[int, ...]
    """M1_STATUS … M4_STATUS."""


class SharedUnitState:
    """The state that all drivers of one controller on one line share."""

    def __init__(self) -> None:
        self.stops = [0] * (AXES + 1)
        """Number of stops of the program (at 0, `PROGRAM`) and of each axis: a motion requested before a stop must not begin
        after it."""
        self.unanswered: list[tuple[int, ...]] = []
        """Axes and program that each stop ends that has not been answered."""
        self.control: ControlRegisters | None = None


THE_PROGRAM = Message("drivers.mic488.the-program", "the program")


class Unit:
    """The controller with slave address ``number`` on ``line``.

    ``scales`` are units and GEAR of the axes; empty if unknown. ``config`` has their ramps, too. Reads are tried ``tries`` times,
    and so are writes that cannot move anything twice.
    """

    def __init__(
        self,
        line: DriverLine[ModbusQuery, bytes],
        number: int,
        registers: RegisterMap,
        config: ControllerConfig | None,
        scales: Sequence[AxisScale],
        *,
        timeout_ns: Nanos,
        tries: int,
    ) -> None:
        self.line = line
        self.number = number
        self.config = config
        self.scales = scales if config is None else [AxisScale(axis.unit_name, axis.gear) for axis in config.axes]
        self.timeout_ns = timeout_ns
        self.tries = tries
        self.shared: SharedUnitState = line.shared.setdefault(("mic488", number), SharedUnitState())
        self._queries: dict[tuple[int, int, int], ModbusQuery]
        self._plans: dict[tuple[RegisterItem, ...], list[Block]]
        self.use(registers)

    def use(self, registers: RegisterMap) -> None:
        """Use the register map of that firmware."""
        self.registers = registers
        self.wording = Wording(registers, self.scales)
        frames = self.line.shared.get("frames")
        if isinstance(frames, FrameLog):
            frames.know(self.number, self.wording)
        self._queries = {}
        self._plans = {}
        keys = ("DATA_TYPE", "PROGRAM_CTRL", "AXIS_CTR_MODE")
        self._control_items = [RegisterItem(registers.of(key)) for key in keys]
        self._has_status = "M_STATUS" in {row.key for row in registers.rows}
        if self._has_status:
            self._control_items.append(RegisterItem(registers.of("M_STATUS")))
        self._control_items += self.axis_items("STATUS")
        (self._control_block,) = plan(registers, self._control_items)
        self._control_query = ModbusQuery(self.number, self._control_block.request, lambda _: "read the control registers")

    @property
    def place(self) -> str:
        return self.line.place

    # ------------------------------------------------------------------ scales

    def unit_name(self, axis: int) -> str:
        """The configured unit of an axis; ``u`` if unknown."""
        return self.scales[axis - 1].unit if self.scales else "u"

    def gear(self, axis: int) -> float | None:
        """Pulses per unit; None if unknown."""
        return self.scales[axis - 1].gear if self.scales else None

    # ------------------------------------------------------------------ exchanges

    async def ask(
        self,
        request: pdu.ModbusRequest,
        *,
        urgent: bool = False,
        permission: Permission | None = None,
        timeout_ns: Nanos | None = None,
        most_attempts: int | None = None,
    ) -> bytes:
        """Send a request and return the answer PDU. Raises `ModbusRefusal` or a `LineFailure`.

        What may begin a motion, and has no ``permission``, is not sent after a stop of any axis. What ends a motion is urgent and
        counts as a stop.
        """
        if most_attempts is None:
            most_attempts = self.tries if repeatable(self.registers, request) else 1
        ended = halted(self.registers, request)
        if permission is None and moves(self.registers, request):
            permission = self.permission(*ALL_AXES)
        query = ModbusQuery(self.number, request, self.wording.request)
        if not ended:
            return await self._exchange(query, urgent, permission, timeout_ns, most_attempts)
        with self.stopping(*ended):
            return await self._exchange(query, True, permission, timeout_ns, most_attempts)

    async def _exchange(
        self, query: ModbusQuery, urgent: bool, permission: Permission | None, timeout_ns: Nanos | None, most_attempts: int
    ) -> bytes:
        job: Job[ModbusQuery, bytes] = Job(
            query, timeout_ns or self.timeout_ns, most_attempts=most_attempts, urgent=urgent, permission=permission
        )
        try:
            return await self.line.exchange(job)
        except pdu.ModbusException as exception:
            raise ModbusRefusal(self.place, query, exception) from None

    async def look(self, function: int, address: int, count: int) -> bytes:
        """Send a read and return its answer."""
        key = (function, address, count)
        query = self._queries.get(key)
        if query is None:
            if len(self._queries) >= QUERIES_KEPT:
                self._queries.clear()
            query = self._queries[key] = ModbusQuery(self.number, pdu.ReadRequest(function, address, count), self.wording.request)
        return await self._exchange(query, False, None, None, self.tries)

    # ------------------------------------------------------------------ values

    def item(self, key: str, index: int | None = None) -> RegisterItem:
        return RegisterItem(self.registers.of(key, index))

    def axis_items(self, key: str) -> list[RegisterItem]:
        return [self.item(key, axis) for axis in range(1, AXES + 1)]

    async def read(self, items: Iterable[RegisterItem], data_type: DataType = DataType.REAL) -> dict[RegisterItem, RegisterValue]:
        """Read values in the form of ``data_type``, in as few frames as possible."""
        wanted = tuple(items)
        blocks = self._plans.get(wanted)
        if blocks is None:
            if len(self._plans) >= QUERIES_KEPT:
                self._plans.clear()
            blocks = self._plans[wanted] = plan(self.registers, wanted)
        values: dict[RegisterItem, RegisterValue] = {}
        for block in blocks:
            request = block.request
            answer = await self.look(request.function, request.address, request.count)
            if request.function == pdu.READ_HOLDING_REGISTERS:
                content: Sequence[int] = words(answer)
            else:
                content = bits(answer, request.count)
            values |= block.values(content, data_type)
        return values

    async def write(
        self,
        item: RegisterItem,
        value: RegisterValue,
        *,
        data_type: DataType = DataType.REAL,
        urgent: bool = False,
        permission: Permission | None = None,
        timeout_ns: Nanos | None = None,
        most_attempts: int | None = None,
    ) -> None:
        """Write a value in the form of ``data_type``."""
        axis = item.register.axis
        request = encoded(item, value, data_type, self.unit_name(axis) if axis else "u")
        await self.ask(request, urgent=urgent, permission=permission, timeout_ns=timeout_ns, most_attempts=most_attempts)

    def ended_by(self, item: RegisterItem, value: RegisterValue) -> tuple[int, ...]:
        """Axes and program that writing ``value`` ends: see `halted`."""
        register = item.register
        if register.type not in (Type.BIT, Type.WORD) or not register.accepts or not register.permits(value):
            return ()
        return halted(self.registers, encoded(item, value, DataType.REAL))

    async def read_user(self, number: int, view: UserFormat, count: int) -> list[RegisterValue]:
        """Read ``count`` user registers from ``number`` on, as ``view``."""
        first = user_item(self.registers, number, view, count)
        items = [first.at(number + view.size * n) for n in range(count)]
        values = await self.read(items)
        return [values[item] for item in items]

    async def write_user(self, number: int, view: UserFormat, values: Sequence[RegisterValue]) -> None:
        first = user_item(self.registers, number, view, len(values))
        flat: list[int] = []
        for n, value in enumerate(values):
            flat += encoded_words(first.at(number + view.size * n), value, DataType.REAL)
        most = pdu.MAX_WRITTEN_REGISTERS - pdu.MAX_WRITTEN_REGISTERS % 2
        for start in range(0, len(flat), most):
            await self.ask(pdu.WriteRegistersRequest(first.address + start, tuple(flat[start : start + most])))

    # ------------------------------------------------------------------ units

    def in_units(self, item: RegisterItem, value: RegisterValue, data_type: DataType) -> tuple[RegisterValue, str]:
        """A value in the form of ``data_type``, converted into units if these are known, and its unit."""
        register = item.register
        axis = register.axis
        name = self.unit_name(axis) if axis else "u"
        if register.type is Type.VALUE and data_type is DataType.DINT and axis is not None:
            gear = self.gear(axis)
            if gear is None:
                return value, register.unit(DataType.DINT)
            return value / gear, register.unit(DataType.REAL, name)
        return value, register.unit(data_type, name)

    def travelling(self, item: RegisterItem, value_u: float, data_type: DataType) -> float:
        """A value in units, converted into the form of ``data_type``. Raises `NotReady` if that needs an unknown GEAR."""
        axis = item.register.axis
        if item.register.type is not Type.VALUE or data_type is DataType.REAL or axis is None:
            return value_u
        gear = self.gear(axis)
        if gear is None:
            raise NotReady(
                self.place,
                GEAR_IS_UNKNOWN(name=item.name),
            )
        return round(value_u * gear)

    async def set_axis(
        self,
        key: str,
        axis: int,
        value_u: float,
        data_type: DataType,
        *,
        permission: Permission | None = None,
        timeout_ns: Nanos | None = None,
    ) -> None:
        """Write a register of an axis, in units."""
        item = self.item(key, axis)
        value = self.travelling(item, value_u, data_type)
        await self.write(item, value, data_type=data_type, permission=permission, timeout_ns=timeout_ns)

    # ------------------------------------------------------------------ what it is doing

    async def control(self, after: Nanos | None = None, timeout_ns: Nanos | None = None) -> ControlRegisters:
        """The control registers, read now, or by another driver since ``after``."""
        known = self.shared.control
        if after is not None and known is not None and known.at >= after:
            return known
        at = self.line.now()
        answer = await self._exchange(self._control_query, False, None, timeout_ns, self.tries)
        values = self._control_block.values(words(answer), DataType.REAL)
        found = [int(values[item]) for item in self._control_items]
        if found[0] not in (DataType.REAL, DataType.DINT):
            raise NotReady(self.place, NO_DATA_TYPE(unit=self.number, value=found[0]))
        status = found[3] if self._has_status else None
        control = ControlRegisters(at, DataType(found[0]), found[1], found[2] == 1, status, tuple(found[-AXES:]))
        self.wording.data_type = control.data_type
        self.shared.control = control
        return control

    async def ready(self, *axes: int) -> ControlRegisters:
        """The control registers. Raises `NotReady` if the controller would not execute a motion now."""
        control = await self.control()
        if control.triggered:
            raise NotReady(
                self.place,
                WAITS_FOR_TRIGGERS(unit=self.number),
            )
        self.check_enabled(control, *axes)
        return control

    def check_enabled(self, control: ControlRegisters, *axes: int) -> None:
        """Raises `NotReady` for an axis that would ignore a motion because its drive is off (MIC-8)."""
        for axis in axes:
            if control.axes[axis - 1] == AxisStatus.OFF:
                raise NotReady(self.place, IS_SWITCHED_OFF(axis=axis, unit=self.number))

    def lock(self) -> AbstractAsyncContextManager[object]:
        """A lock for exchanges that no other motion command may interrupt."""
        return self.line.lock(("mic488", self.number))

    def permission(
        self,
        *axes: int,
        patience_ns: Nanos | None = None,
        has_begun: bool = False,
        own: Mapping[int, int] = MappingProxyType({}),
    ) -> Permission:
        """Permission for a request made now. It ends with a stop of one of the axes or of the program, or after `PATIENCE_NS`;
        while such a stop is unanswered there is none.

        ``has_begun``: for what goes on when the program is stopped. ``own``: number of stops since now, of each axis, that do not
        end it.
        """
        stops, places = self.shared.stops, axes if has_begun else (PROGRAM, *axes)
        is_stopping = any(not set(places).isdisjoint(ended) for ended in tuple(self.shared.unanswered))
        before = [stops[place] - own.get(place, 0) for place in places]
        if patience_ns is None:
            patience_ns = max(PATIENCE_NS, 2 * self.tries * self.timeout_ns)
        return Permission(
            self.line.now,
            patience_ns,
            lambda: is_stopping or [stops[place] - own.get(place, 0) for place in places] != before,
        )

    @contextmanager
    def stopping(self, *ended: int) -> Generator[None]:
        """Stop axes and `PROGRAM` inside: motions that were requested before its end are not begun after it."""
        for place in ended:
            self.shared.stops[place] += 1
        self.shared.unanswered.append(ended)
        try:
            yield
        finally:
            self.shared.unanswered.remove(ended)

    @asynccontextmanager
    async def stopping_if_late(self, *axes: int, program: bool = False) -> AsyncGenerator[None]:
        """Stop the axes if their motion was sent too late (`SentLate`), and before it pause the ``program`` that may have been
        started. Raises `Unconfirmed`."""
        try:
            yield
        except SentLate as late:
            try:
                try:
                    if program:
                        await self.end_program(ProgramState.PAUSED, "paused")
                finally:
                    await self.stop(axes)
            except LineFailure as failure:
                raise Unconfirmed(TOO_LATE_AND_UNCONFIRMED(problem=text_of(failure))) from late
            raise

    async def end_program(self, state: ProgramState, what: str) -> None:
        """Stop or pause the program, before all waiting requests. Raises `Unconfirmed`."""
        try:
            await self.write(self.item("PROGRAM_CTRL"), state, urgent=True, most_attempts=URGENT_TRIES)
        except LineFailure as failure:
            raise unconfirmed(THE_PROGRAM(), what, failure) from failure

    async def stop(self, axes: Sequence[int], key: str = "M_STOP", what: str = "stopped") -> None:
        """Stop axes in the same instant, before all waiting requests. Raises `Unconfirmed`."""
        with self.stopping(*axes):
            try:
                await self.write(self.item(key), axis_mask(axes), urgent=True, most_attempts=URGENT_TRIES)
            except LineFailure as failure:
                raise unconfirmed(" ".join(f"M{axis}" for axis in axes), what, failure) from failure


def axis_mask(axes: Iterable[int]) -> int:
    """Axes as bits of M_STOP and similar registers."""
    return sum(1 << check_axis(axis) - 1 for axis in set(axes))


UNKNOWN_AXIS = Message("drivers.mic488.unknown-axis", "no axis {axis}: axes are 1 to {most}")


def check_axis(axis: int) -> int:
    if axis not in range(1, AXES + 1):
        raise Misuse(UNKNOWN_AXIS(axis=axis, most=AXES))
    return axis
