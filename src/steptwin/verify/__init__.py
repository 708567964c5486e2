"""Checks of a controller that confirm or refute the assumptions (docs/assumptions.md).

A check asks the controller and compares what comes with what the twin would do. By default it only reads, and sends requests
that are to be refused; what writes or moves needs a permission and is put back. Pure but for `steptwin.verify.run` and what
prepares the checks of a kind of device (`mic488_kind`, `m1486_kind`).
"""
