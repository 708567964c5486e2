"""Coverage of motion programs: which statements were executed, and which ways branches went.

`steptwin.coverage.watch.WorldCoverage` counts in a world, `steptwin.coverage.counts.Coverage` adds up, and the other modules make
texts of it: the reports.
"""
