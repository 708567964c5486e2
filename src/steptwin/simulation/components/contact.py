"""Common keys of contacts."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import INPUT_PIN, Terminal, time_value, whole, word


@table()
class ContactSpec(TableSpec):
    """The keys of every contact, behind those of its own."""

    target: Terminal = key(INPUT_PIN, "the input: CONTROLLER.PIN", name="to")
    contact: str = key(word("NO", "NC"), "NO (closed while on) or NC (open while on)", default="NO", order=1)
    join: str | None = key(
        word("parallel", "series"),
        "contacts of one input: parallel (1 while any is closed) or series (while all are)",
        default=None,
        order=1,
    )
    bounce: Nanos = key(time_value, "how long the contact bounces, such as '3 ms'", default=0, order=1)
    bounces: int = key(whole(1, 100), "how often it opens again meanwhile", default=3, needs="bounce", order=1)
