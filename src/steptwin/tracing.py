"""Traces of requests: from a gateway over a line to a device, and how long each part takes. Nothing is traced without a tracer.

A span belongs to the one around it in the same task. `steptwin.live.telemetry` sends them to an OpenTelemetry collector.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Protocol, TypeAlias

Attribute: TypeAlias = str | int | float | bool


class TraceSpan(Protocol):
    def set_attribute(self, name: str, value: Attribute) -> None:
        """Note what is known after its begin."""
        ...


class NoSpan:
    """Span of what is not traced."""

    def set_attribute(self, name: str, value: Attribute) -> None:
        """Nobody asks."""


Tracer: TypeAlias = Callable[[str, Mapping[str, Attribute], bool], AbstractContextManager[TraceSpan]]
"""Makes a span from its name, what is known of it, and whether it is only traced as a part of another one."""

_NOTHING: AbstractContextManager[TraceSpan] = nullcontext(NoSpan())
_tracers: list[Tracer] = []


def span(name: str, attributes: Mapping[str, Attribute], *, is_part: bool = False) -> AbstractContextManager[TraceSpan]:
    """A request, or a part of one, while it is entered. An exception marks it as failed, and passes.

    ``is_part``: it is traced within another span only, so that what a program does by itself, such as polling, is left out.
    """
    return _tracers[-1](name, attributes, is_part) if _tracers else _NOTHING


def is_traced() -> bool:
    return bool(_tracers)


@contextmanager
def traced_by(tracer: Tracer) -> Generator[None]:
    """Within, ``tracer`` makes the spans."""
    _tracers.append(tracer)
    try:
        yield
    finally:
        _tracers.remove(tracer)
