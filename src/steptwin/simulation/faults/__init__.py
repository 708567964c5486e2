"""Faults, seeded and targeted: bytes, frames, protocol, physics.

`parse` and `read` make a `Fault` of a table or a line of text; `Faults` is the set of those that are set. A `FaultyPort` stands
between a link and a port, `prepare_for_faults` lets a controller in its scheduler have faults. `steptwin fault --kinds` shows
`KINDS`.
"""

from steptwin.simulation.faults.active import ActiveFault, Faults
from steptwin.simulation.faults.controller import AxisLoad, Body, FaultyController, prepare_for_faults
from steptwin.simulation.faults.fault import EXAMPLE, GRAMMAR, FaultMistake, parse, read, schema
from steptwin.simulation.faults.kinds import KINDS
from steptwin.simulation.faults.port import FaultyPort, FaultySendingPort
from steptwin.simulation.faults.routes import RequestRoute, check_route
from steptwin.simulation.faults.table import Fault, FaultKind, Layer, LineProtocol, Occasion, Parameter

__all__ = [
    "EXAMPLE",
    "GRAMMAR",
    "KINDS",
    "ActiveFault",
    "AxisLoad",
    "Body",
    "Fault",
    "FaultKind",
    "FaultMistake",
    "Faults",
    "FaultyController",
    "FaultyPort",
    "FaultySendingPort",
    "Layer",
    "LineProtocol",
    "Occasion",
    "Parameter",
    "RequestRoute",
    "check_route",
    "parse",
    "prepare_for_faults",
    "read",
    "schema",
]
