"""The studio of a live world, of devices, or of both: its start, and what the page asks of the computer."""
