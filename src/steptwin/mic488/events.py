"""The events of a MIC488, which no register shows. Codes are stable."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.datasheet import EventDescription, FactDescription, FactType

_AXIS = (FactDescription(name="axis", type=FactType.WHOLE),)
_AXIS_OR_NONE = (FactDescription(name="axis", type=FactType.WHOLE, is_optional=True),)
"""Absent for a motion of several axes."""


def _of_axis(code: str, meaning: str) -> EventDescription:
    return EventDescription(code=code, meaning=meaning, facts=_AXIS)


def _of_controller(code: str, meaning: str) -> EventDescription:
    return EventDescription(code=code, meaning=meaning)


EVENTS: Mapping[str, EventDescription] = {
    event.code: event
    for event in (
        _of_controller("power-on", "It was switched on, or off and on again."),
        _of_controller("memory-failure", "The non-volatile memory could not be kept."),
        _of_controller("frame-pause", "A request had a pause inside for which the controller drops a frame (MIC-15)."),
        _of_controller("internal-error", "A request failed because of a mistake in steptwin."),
        _of_controller("program-error", "A program ended with an error."),
        _of_controller("path-left", "An axis slows down because the other axis left their path."),
        EventDescription(code="drive-off", meaning="A motion was ignored: a drive is not enabled.", facts=_AXIS_OR_NONE),
        EventDescription(
            code="speed-clamped",
            meaning="A velocity was lowered to what the axis permits.",
            facts=_AXIS_OR_NONE,
        ),
        _of_axis("overrun", "An axis cannot brake before its soft limit."),
        _of_axis("limit", "An axis was stopped by a limit switch."),
        _of_axis("homed", "An axis is at its home position."),
        _of_axis("trigger-empty", "A trigger came without a new value."),
        _of_axis("position-error", "An axis did not reach its position."),
    )
}
