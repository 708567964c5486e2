"""Requests for what takes a while on the lines of this computer: the search for devices, and the checks of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from steptwin.access.roles import LOOK, SERVICE
from steptwin.studio.requestrow import NOTHING, RequestRow
from steptwin.subject.fields import FLAG, NAMES, TEXT, Field, Schema, number
from steptwin.subject.shapes import members


@dataclass(frozen=True, slots=True)
class Scan:
    """Begins a search for devices."""

    places: tuple[str, ...] = ()
    kind: str = "any"
    units: str = "1-16"
    baud: str | None = None
    timeout: float = 0.1


@dataclass(frozen=True, slots=True)
class Verify:
    """Begins the checks of a device."""

    address: str
    write: bool = False


@dataclass(frozen=True, slots=True)
class ReadWork:
    """Requests the search or the checks that were begun last."""


@dataclass(frozen=True, slots=True)
class CancelWork:
    """Ends a search or checks."""


WorkRequest: TypeAlias = Scan | Verify | ReadWork | CancelWork

_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}
_FLAG: Schema = {"type": "boolean"}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def _list(schema: Schema) -> Schema:
    return {"type": "array", "items": schema}


_FOUND = members({"device": {**_TEXT, "description": "As connect takes it."}, "what": _TEXT})
_PROBE = members({"what": _TEXT, "expected": _TEXT, "came": _TEXT, "holds": _FLAG})
_RESULT = members(
    {
        "id": {**_TEXT, "description": "Of the interpretation."},
        "outcome": {"enum": ["confirmed", "refuted", "not checked"]},
        "what": _TEXT,
        "why": {**_TEXT, "description": "It was not checked."},
        "probes": _list(_PROBE),
    }
)
_REPORT = members(
    {
        "format": _TEXT,
        "steptwin": {**_TEXT, "description": "Version."},
        "time": _TEXT,
        "device": {"type": "object"},
        "permitted": _TEXT,
        "is_complete": _FLAG,
        "counts": {"type": "object", "additionalProperties": _WHOLE},
        "results": _list(_RESULT),
    }
)
_WORK = members(
    {
        "work": {"enum": ["scan", "verify"]},
        "is_running": _FLAG,
        "doing": {**_TEXT, "description": "What is tried at present."},
        "step": _WHOLE,
        "steps": _WHOLE,
        "tried": _list(_TEXT),
        "found": _list(_FOUND),
        "problems": _list(_TEXT),
        "report": _or_null(_REPORT),
    }
)

WORKS = (
    RequestRow(
        "scan",
        Scan,
        SERVICE,
        "Search lines for devices, as steptwin scan does: nothing moves, and no setting is changed. The answer to work has what "
        "is found.",
        NOTHING,
        (
            Field("places", NAMES, "Ports and addresses; all serial ports without.", ()),
            Field("kind", TEXT, "any, mic488 or m1486.", "any"),
            Field("units", TEXT, "Slave addresses of MIC488, such as 1-16.", "1-16"),
            Field("baud", TEXT, "Baud rates of serial ports, such as 9600,38400; the usual ones without.", None),
            Field("timeout", number(0.01, 10.0), "Time to wait for each answer, besides that on the wire.", 0.1, "s"),
        ),
    ),
    RequestRow(
        "verify",
        Verify,
        SERVICE,
        "Check a device that is not connected, as steptwin verify does. The answer to work has the report.",
        NOTHING,
        (
            Field("address", TEXT, "As of connect."),
            Field("write", FLAG, "Permit checks that write settings and put them back.", False),
        ),
    ),
    RequestRow("work", ReadWork, LOOK, "The search or the checks that were begun last.", _or_null(_WORK)),
    RequestRow(
        "cancel_work", CancelWork, SERVICE, "A search ends with what it has found, checks after the present one.", NOTHING
    ),
)
