"""The debugger of programs in worlds, forwards and backwards in time; it knows nothing of editors and protocols.

`steptwin.debug.debugger.Debugger` stands *between* moments of a world: just before the one at which a statement is executed. So
it changes nothing: a run in which it stops a thousand times is the run without it. To go back it replays what happened
(`steptwin.simulation.world.snapshotlog`).
"""
