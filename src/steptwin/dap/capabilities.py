"""Capabilities of the debugger, as the answer to ``initialize``."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.debug.values import Events

_STOPS_USUALLY = (Events.PROGRAM_ERROR, Events.WRONG_DATA)
CAPABILITIES: Mapping[str, object] = {
    "supportsConfigurationDoneRequest": True,
    "supportsFunctionBreakpoints": True,
    "supportsConditionalBreakpoints": True,
    "supportsHitConditionalBreakpoints": True,
    "supportsLogPoints": True,
    "supportsDataBreakpoints": True,
    "supportsEvaluateForHovers": True,
    "supportsStepBack": True,
    "supportsSetVariable": True,
    "supportsSetExpression": True,
    "supportsRestartRequest": True,
    "supportsTerminateRequest": True,
    "supportsLoadedSourcesRequest": True,
    "supportsBreakpointLocationsRequest": True,
    "exceptionBreakpointFilters": [
        {"filter": event.code, "label": event.title, "default": event in _STOPS_USUALLY} for event in Events
    ],
}
