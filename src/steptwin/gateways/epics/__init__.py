"""EPICS: controllers as records over Channel Access, axes as motor records.

The protocol is caproto's; the rules of the motor record are here, from the documentation of epics-modules/motor and from what
clients expect.
"""
