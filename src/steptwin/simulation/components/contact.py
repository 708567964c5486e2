"""What all contacts have in their tables."""

from __future__ import annotations

from steptwin.simulation.toml.reader import optional
from steptwin.simulation.toml.values import time_value, whole, word

CONTACT_KEYS = (
    optional(word("NO", "NC"), "contact", "NO (closed while on) or NC (open while on)", "NO"),
    optional(
        word("parallel", "series"), "join", "contacts of one input: parallel (1 while any is closed) or series (while all are)"
    ),
    optional(time_value, "bounce", "how long the contact bounces, such as '3 ms'", 0),
    optional(whole(1, 100), "bounces", "how often it opens again meanwhile", 3),
)
