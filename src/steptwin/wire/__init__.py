"""Data on the line: Modbus PDUs, RTU and TCP frames, slave ports, serial line timing. Pure: no clock, no sockets.

Reading order: `pdu` (requests and responses), `rtu` and `mbap` (their frames), `slave` (a device behind a frame),
`timed` (the same with the time a real serial line takes).
"""
