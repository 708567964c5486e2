"""Records for values of controllers, and for commands without arguments."""

from __future__ import annotations

import math
import time

from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.gateways.epics.controller import EpicsController
from steptwin.gateways.epics.records import (
    DEFAULT_FIELD,
    LOST,
    NO_ALARM,
    NOT_KNOWN,
    TOO_LARGE,
    FieldQuantity,
    FieldRow,
    FieldType,
    FieldValue,
    Putter,
    RecordBase,
)
from steptwin.gateways.methods import MethodRow
from steptwin.gateways.points import GatewayPoint, PointType
from steptwin.gateways.sampling import Sample

LONG = 2**31
DECIMALS = 3
_TYPES = {
    PointType.TRUTH: FieldType.STATES,
    PointType.WHOLE: FieldType.LONG,
    PointType.NUMBER: FieldType.DOUBLE,
    PointType.TEXT: FieldType.STRING,
}
_RECORD_TYPES = {
    PointType.TRUTH: ("bi", "bo"),
    PointType.WHOLE: ("longin", "longout"),
    PointType.NUMBER: ("ai", "ao"),
    PointType.TEXT: ("stringin", "stringout"),
}
"""Read only, and writable."""
OFF_ON = ("0", "1")


def _text(name: str, meaning: str) -> FieldRow:
    return FieldRow(name=name, meaning=meaning, type=FieldType.STRING)


class PointRecord(RecordBase):
    """The record ``name`` of a value of ``controller``. Satisfies `Record` and `SampledRecord`."""

    is_busy = False
    precision = DECIMALS

    def __init__(self, name: str, point: GatewayPoint, controller: EpicsController) -> None:
        super().__init__()
        self.alarm = NOT_KNOWN
        self.at_s = 0.0
        self._point = point
        self._controller = controller
        row = FieldRow(
            name=DEFAULT_FIELD,
            meaning=point.meaning,
            type=_TYPES[point.type],
            is_writable=point.write is not None,
            states=OFF_ON,
            quantity=FieldQuantity.VALUE,
        )
        texts = {
            "NAME": name,
            "DESC": point.meaning,
            "EGU": point.unit,
            "RTYP": _RECORD_TYPES[point.type][point.write is not None],
        }
        self._fields = {DEFAULT_FIELD: row} | {text: _text(text, "") for text in texts}
        self._values: dict[str, FieldValue] = dict(texts)
        self._values[DEFAULT_FIELD] = "" if point.type is PointType.TEXT else 0

    def unit_of(self, row: FieldRow) -> str:
        return self._point.unit if row.quantity is FieldQuantity.VALUE else ""

    def limits_of(self, row: FieldRow) -> Limits | None:
        return self._point.limits if row.quantity is FieldQuantity.VALUE else None

    def field(self, name: str) -> FieldRow | None:
        return self._fields.get(name)

    def value(self, name: str) -> FieldValue:
        return self._values[name]

    async def refresh(self) -> None:
        await self._controller.refresh()

    async def take(self, sample: Sample, *, is_sure: bool) -> None:
        if not self.is_asked_for:
            return
        self.at_s = sample.at.timestamp()
        value = None if sample.state is None else self._point.typed_value(sample.state)
        if value is None:
            self.alarm = LOST if sample.state is None else NOT_KNOWN
        elif isinstance(value, int) and not -LONG <= value < LONG:
            self.alarm = TOO_LARGE
        else:
            self.alarm = NO_ALARM
            self._values[DEFAULT_FIELD] = int(value) if isinstance(value, bool) else value
        await self.show()

    async def put(self, who: Putter, name: str, value: FieldValue) -> None:
        if self._point.write is None or isinstance(value, str):
            raise Misuse(f"{self._values['NAME']} cannot be written")
        if not math.isfinite(value):
            raise Misuse(f"{self._values['NAME']}: {value}: expected a number")
        limits = self._point.limits
        if limits is not None:
            is_low = limits.low is not None and (value <= limits.low if limits.is_low_excluded else value < limits.low)
            if is_low or (limits.high is not None and value > limits.high):
                raise Misuse(f"{self._values['NAME']}: {value:g} {self._point.unit}: permitted are {_range(limits)}")
        await self._controller.do(who, self._point.write(float(value)))
        await self._controller.refresh()

    def stopped(self, axis: int | None) -> None:
        pass

    async def leave(self, circuit: object) -> None:
        pass


def _range(limits: Limits) -> str:
    if limits.low is None:
        return f"numbers up to {limits.high:g}"
    above = "above " * limits.is_low_excluded
    if limits.high is None:
        return f"numbers {above or 'from '}{limits.low:g}"
    return f"{above}{limits.low:g} to {limits.high:g}"


class CommandRecord(RecordBase):
    """The record ``name`` of a command of ``controller``: a put of 1 does it, and it is 0 again then. Satisfies `Record`."""

    precision = 0
    alarm = NO_ALARM

    def __init__(self, name: str, row: MethodRow, controller: EpicsController) -> None:
        super().__init__()
        self.at_s = time.time()
        self._row = row
        self._controller = controller
        self._field = FieldRow(
            name=DEFAULT_FIELD, meaning=row.meaning, type=FieldType.STATES, is_writable=True, states=("Done", "Do")
        )
        self._texts = {"NAME": name, "DESC": row.meaning, "RTYP": "bo"}

    def unit_of(self, row: FieldRow) -> str:
        return ""

    def limits_of(self, row: FieldRow) -> Limits | None:
        return None

    def field(self, name: str) -> FieldRow | None:
        return self._field if name == DEFAULT_FIELD else _text(name, "") if name in self._texts else None

    def value(self, name: str) -> FieldValue:
        return self._texts.get(name, 0)

    async def put(self, who: Putter, name: str, value: FieldValue) -> None:
        if value:
            self.at_s = time.time()
            await self._controller.do(who, self._row.make(self._controller.name, None))
            await self._controller.refresh()

    async def refresh(self) -> None:
        pass
