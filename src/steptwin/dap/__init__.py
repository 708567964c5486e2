"""The debug adapter: `steptwin dap` speaks the Debug Adapter Protocol.

`steptwin.debug` does the work and knows nothing of the protocol; `adapter` turns requests into its calls, `wire` frames messages,
`launch` makes the world of a program.
"""
