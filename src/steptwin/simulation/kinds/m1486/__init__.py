"""The M1486 in a world; `steptwin.simulation.kinds.m1486.kind` is its interface."""
