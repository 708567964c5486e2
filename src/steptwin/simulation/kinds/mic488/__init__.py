"""The MIC488 in a world; `steptwin.simulation.kinds.mic488.kind` is its interface."""
