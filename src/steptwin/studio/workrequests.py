"""Requests for what takes a while on the lines of this computer: the search for devices, and the checks of one."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, TypeAlias

from steptwin.access.roles import LOOK, SERVICE
from steptwin.fields import Meaning, number
from steptwin.jsonvalues import FLAG, TEXT, UNWRITTEN, WHOLE, JsonForm, list_of, members, shape
from steptwin.studio.requesttype import request
from steptwin.verify.check import CheckResult

_REPORT = members(
    {
        "format": TEXT,
        "steptwin": {**TEXT, "description": "Version."},
        "time": TEXT,
        "device": {"type": "object"},
        "permitted": TEXT,
        "is_complete": FLAG,
        "counts": {"type": "object", "additionalProperties": WHOLE},
        "results": list_of(shape(CheckResult)),
    }
)


@dataclass(frozen=True, slots=True)
class FoundOnLine:
    """A device that a search has found."""

    device: Annotated[str, "As connect takes it."]
    what: str


class Cancelled(Exception):
    """The work was cancelled."""


@dataclass(slots=True)
class Work:
    """A search or checks in progress, and the results. Written by its thread, read by the event loop."""

    work: Annotated[str, JsonForm({"enum": ["scan", "verify"]})]
    is_running: bool = True
    doing: Annotated[str, "What is tried at present."] = ""
    step: int = 0
    steps: int = 0
    tried: list[str] = field(default_factory=list)
    found: list[FoundOnLine] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    report: Annotated[Mapping[str, object], JsonForm(_REPORT)] | None = None
    is_cancelled: Annotated[bool, UNWRITTEN] = False

    def check(self, id_: str, number: int, count: int) -> None:
        """Progress of checks."""
        self.doing, self.step, self.steps = id_, number, count

    @contextlib.contextmanager
    def search(self, title: str, total: int, form: str) -> Generator[Callable[[int], object]]:
        """Progress of a search on a line."""
        self.doing, self.step, self.steps = title, 0, total
        if self.is_cancelled:
            raise Cancelled

        def tried(number: int) -> None:
            if self.is_cancelled:
                raise Cancelled
            self.step += 1
            self.doing = f"{title} {number:{form}}"

        yield tried
        self.tried.append(title)


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


@request("work", LOOK, "The search or the checks that were begun last.", Work | None)
@dataclass(frozen=True, slots=True)
class ReadWork:
    pass


@request("cancel_work", SERVICE, "A search ends with what it has found, checks after the present one.")
@dataclass(frozen=True, slots=True)
class CancelWork:
    pass


WorkRequest: TypeAlias = Scan | Verify | ReadWork | CancelWork
