"""The place of an element in the text of a description: where it is written, and that text with another place in it."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple, TypeAlias

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.simulation.components.frames import HAS_NO_PLACE
from steptwin.simulation.components.mount import places, point
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.space.frames import NM_PER_MM
from steptwin.simulation.toml.keypaths import find_spans

STANDS_WITH = Message("simulation.stands-with", "{name} has no place of its own: it stands where {other} is, so move {other}")
IN_A_PART = Message(
    "simulation.place-in-a-part",
    "the place of {name} is in line {line} of {file}, which the [[use]] in line {use} puts in with its parameters, as others "
    "may: change it there",
)
OTHER_TEXT = Message(
    "simulation.place-in-another-text",
    "the description has {name} in another form than [[{kind}]], or is another one than that of this machine: change it there",
)
_DECIMALS = 4
Point: TypeAlias = tuple[float, float, float]


class Placing(NamedTuple):
    """``at``: of an element, mm, as the text had it, by the key ``old`` in ``line``; ``text`` has ``new``. Both may be empty."""

    at: Point
    line: int
    old: str
    new: str
    text: str


def placing(spec: WorldSpec, text: str, name: str, at: Sequence[float] | None = None) -> Placing:
    """Put an element of ``spec`` elsewhere in a state of its text, of which only numbers that differ are changed.

    ``at``: mm; None: where it is. Raises `Misuse` for what has no place in space, `Refusal` where it is not written in this text.
    """
    kind = _kind(spec, name)
    try:
        data = tomllib.loads(text)
        n, table = next((n, table) for n, table in enumerate(data[kind]) if table["name"] == name)
        given = table.get("at")
        x, y, z = (one / NM_PER_MM for one in point([0, 0, 0] if given is None else given))
    except (Misuse, tomllib.TOMLDecodeError, LookupError, TypeError, StopIteration):
        raise Refusal(OTHER_TEXT(name=name, kind=kind)) from None
    spans, source = find_spans(text), SourceText("", text)
    wanted = [round(one, _DECIMALS) + 0.0 for one in at or (x, y, z)]
    if given is None:
        span = spans[(kind, n, "on") if "on" in table else (kind, n, "name")]
        line, begin = source.position(span.start)[0] + 1, text.find("\n", span.end) + 1 or len(text)
        if not any(wanted):
            return Placing((x, y, z), line - 1, "", "", text)
        old, new, end = "", f"at = [{', '.join(_number(one, '0') for one in wanted)}]", "\r\n" if "\r\n" in text else "\n"
        found = text[:begin] + text[text.rfind("\n", 0, span.start) + 1 : span.start] + new + end + text[begin:]
    else:
        whole, found = spans[kind, n, "at"], text
        line, old = source.position(whole.start)[0], text[whole.start : whole.end]
        for k, here in (2, z), (1, y), (0, x):
            item = spans[kind, n, "at", k]
            if wanted[k] != here:
                found = found[: item.start] + _number(wanted[k], text[item.start : item.end]) + found[item.end :]
        new = found[whole.start : whole.end + len(found) - len(text)]
    table["at"] = wanted
    with suppress(tomllib.TOMLDecodeError):
        if tomllib.loads(found) == data:
            return Placing((x, y, z), line, old, new, found)
    raise Refusal(OTHER_TEXT(name=name, kind=kind))


def _kind(spec: WorldSpec, name: str) -> str:
    """The tables among which that of an element with a place of its own is."""
    mounts = spec.elements.mounts
    place = places(mounts).get(name)
    if place is None:
        raise Misuse(HAS_NO_PLACE(name=name))
    if place is not mounts[name]:
        raise Refusal(STANDS_WITH(name=name, other=mounts[name].mounted_as))
    line, file = spec.text.place((*place.path, "at"))
    if file is not None:
        raise Refusal(IN_A_PART(name=name, line=line, file=file, use=spec.text.use_of(place.path)))
    return str(place.path[0])


def _number(mm: float, like: str) -> str:
    """As one writes it: with a point where ``like`` has one, or it needs one."""
    short = f"{mm:.{_DECIMALS}f}".rstrip("0").rstrip(".")
    return short if "." in short or "." not in like else f"{short}.0"
