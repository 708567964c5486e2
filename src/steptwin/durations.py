"""Times as people write them: ``5 ms``, ``1.5s``, ``2 min``. A number that is no text is of seconds."""

from __future__ import annotations

import re
from decimal import Decimal
from functools import lru_cache

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message

UNITS: dict[str, Nanos] = {"us": MICROSECOND, "ms": MILLISECOND, "s": SECOND, "min": 60 * SECOND, "h": 3600 * SECOND}
LONGEST_NS: Nanos = 366 * 24 * UNITS["h"]
_DURATION = re.compile(r"(\d{1,30}(?:\.\d{1,30})?|\.\d{1,30}) *([a-z]*)\Z", re.ASCII)


NO_UNIT = Message("durations.no-unit", "{value} has no unit: expected a number with {names}, such as '90 s' or '500 ms'")
NO_DURATION = Message(
    "durations.no-duration", "{value} is not a time: expected a number with {names}, such as '90 s' or '500 ms'"
)
TOO_LONG = Message("durations.too-long", "{value} is too long: permitted are 0 to {most} h")


def duration(value: object) -> Nanos:
    """Nanoseconds of a text or of a number of seconds. Raises `Misuse` with what is permitted."""
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < float("inf"):
        text: object = f"{Decimal(str(value)):f}s"
    else:
        text = value
    found = _of_text(text.strip().lower()) if isinstance(text, str) else None
    if found is None:
        is_bare = isinstance(text, str) and _of_text(f"{text.strip()}s") is not None
        raise Misuse((NO_UNIT if is_bare else NO_DURATION)(value=repr(value), names=list(UNITS)))
    if found > LONGEST_NS:
        raise Misuse(TOO_LONG(value=repr(value), most=LONGEST_NS // UNITS["h"]))
    return found


@lru_cache(maxsize=1024)
def _of_text(text: str) -> Nanos | None:
    """Nanoseconds; None for what is not a time. 0 is 0 in any unit."""
    match = _DURATION.match(text)
    if match is None or not (match[2] or Decimal(match[1]) == 0):
        return None
    unit = UNITS.get(match[2] or "s")
    return None if unit is None else int(Decimal(match[1]) * unit)


def duration_text(time: Nanos) -> str:
    """A duration as `duration` reads it, exactly: ``90 s``, ``1500 us``; with a sign where it is negative."""
    if time < 0:
        return f"-{duration_text(-time)}"
    for unit, size in (("s", SECOND), ("ms", MILLISECOND), ("us", MICROSECOND)):
        if time % size == 0:
            return f"{time // size} {unit}"
    whole, rest = divmod(time, MICROSECOND)
    return f"{whole}.{rest:03d} us"
