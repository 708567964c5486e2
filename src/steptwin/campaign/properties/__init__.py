"""Temporal conditions over the signals of a world: exact, with the distance from being violated (ADR 28)."""

from steptwin.campaign.case import Verdict
from steptwin.campaign.properties.watch import Property, PropertyWatch, WatchState, read_property, watch_together

__all__ = ["Property", "PropertyWatch", "Verdict", "WatchState", "read_property", "watch_together"]
