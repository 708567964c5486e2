"""Requests for what takes a while on the lines of this computer: the search for devices, and the checks of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

from steptwin.access.roles import LOOK, SERVICE
from steptwin.fields import Meaning, number
from steptwin.jsonvalues import FLAG, TEXT, WHOLE, list_of, members, or_null
from steptwin.studio.requesttype import request

_FOUND = members({"device": {**TEXT, "description": "As connect takes it."}, "what": TEXT})
_PROBE = members({"what": TEXT, "expected": TEXT, "came": TEXT, "holds": FLAG})
_RESULT = members(
    {
        "id": {**TEXT, "description": "Of the assumption."},
        "outcome": {"enum": ["confirmed", "refuted", "not checked"]},
        "what": TEXT,
        "why": {**TEXT, "description": "It was not checked."},
        "probes": list_of(_PROBE),
    }
)
_REPORT = members(
    {
        "format": TEXT,
        "steptwin": {**TEXT, "description": "Version."},
        "time": TEXT,
        "device": {"type": "object"},
        "permitted": TEXT,
        "is_complete": FLAG,
        "counts": {"type": "object", "additionalProperties": WHOLE},
        "results": list_of(_RESULT),
    }
)
_WORK = members(
    {
        "work": {"enum": ["scan", "verify"]},
        "is_running": FLAG,
        "doing": {**TEXT, "description": "What is tried at present."},
        "step": WHOLE,
        "steps": WHOLE,
        "tried": list_of(TEXT),
        "found": list_of(_FOUND),
        "problems": list_of(TEXT),
        "report": or_null(_REPORT),
    }
)


@request(
    "scan",
    SERVICE,
    "Search lines for devices, as steptwin scan does: nothing moves, and no setting is changed. The answer to work has what "
    "is found.",
)
@dataclass(frozen=True, slots=True)
class Scan:
    places: Annotated[tuple[str, ...], Meaning("Ports and addresses; all serial ports without.")] = ()
    kind: Annotated[str, Meaning("any, mic488 or m1486.")] = "any"
    units: Annotated[str, Meaning("Slave addresses of MIC488, such as 1-16.")] = "1-16"
    baud: Annotated[str | None, Meaning("Baud rates of serial ports, such as 9600,38400; the usual ones without.")] = None
    timeout: Annotated[
        float, Meaning("Time to wait for each answer, besides that on the wire.", number(0.01, 10.0), unit="s")
    ] = 0.1


@request("verify", SERVICE, "Check a device that is not connected, as steptwin verify does. The answer to work has the report.")
@dataclass(frozen=True, slots=True)
class Verify:
    address: Annotated[str, Meaning("As of connect.")]
    write: Annotated[bool, Meaning("Permit checks that write settings and put them back.")] = False


@request("work", LOOK, "The search or the checks that were begun last.", or_null(_WORK))
@dataclass(frozen=True, slots=True)
class ReadWork:
    pass


@request("cancel_work", SERVICE, "A search ends with what it has found, checks after the present one.")
@dataclass(frozen=True, slots=True)
class CancelWork:
    pass


WorkRequest: TypeAlias = Scan | Verify | ReadWork | CancelWork
