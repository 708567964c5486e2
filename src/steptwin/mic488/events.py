"""The events of a MIC488, which no register shows. Codes are stable."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.datasheet import EventDescription, EventSeverity, FactDescription, FactType

_INFORMATION, _WARNING, _ALARM = EventSeverity.INFORMATION, EventSeverity.WARNING, EventSeverity.ALARM
_AXIS = (FactDescription(name="axis", type=FactType.WHOLE),)
_AXIS_OR_NONE = (FactDescription(name="axis", type=FactType.WHOLE, is_optional=True),)
"""Absent for a motion of several axes."""


def _of_axis(code: str, severity: EventSeverity, meaning: str, *, stops: bool | None = None) -> EventDescription:
    return EventDescription(code=code, meaning=meaning, facts=_AXIS, severity=severity, stops_motor=stops)


def _of_motion(code: str, severity: EventSeverity, meaning: str, *, stops: bool | None = None) -> EventDescription:
    """Kind of event of one or several axes."""
    return EventDescription(code=code, meaning=meaning, facts=_AXIS_OR_NONE, severity=severity, stops_motor=stops)


def _of_controller(code: str, severity: EventSeverity, meaning: str, *, stops: bool | None = None) -> EventDescription:
    return EventDescription(code=code, meaning=meaning, severity=severity, stops_motor=stops)


EVENTS: Mapping[str, EventDescription] = {
    event.code: event
    for event in (
        _of_controller("power-on", _INFORMATION, "It was switched on, or off and on again."),
        _of_controller("memory-failure", _ALARM, "The non-volatile memory could not be kept.", stops=False),
        _of_controller(
            "frame-pause",
            _WARNING,
            "A request had a pause inside for which the controller drops a frame (MIC-15).",
            stops=False,
        ),
        _of_controller("internal-error", _ALARM, "A request failed because of a mistake in steptwin."),
        _of_controller("program-error", _ALARM, "A program ended with an error."),
        _of_controller("path-left", _ALARM, "An axis slows down because the other axis left their path."),
        _of_motion("drive-off", _WARNING, "A motion was ignored: a drive is not enabled.", stops=True),
        _of_motion("speed-clamped", _WARNING, "A velocity was lowered to what the axis permits.", stops=False),
        _of_axis("overrun", _ALARM, "An axis cannot brake before its soft limit.", stops=False),
        _of_axis("limit", _WARNING, "An axis was stopped by a limit switch.", stops=True),
        _of_axis("homed", _INFORMATION, "An axis is at its home position."),
        _of_axis("trigger-empty", _WARNING, "A trigger came without a new value.", stops=False),
        _of_axis("position-error", _ALARM, "An axis did not reach its position.", stops=True),
    )
}
