"""Frames, bodies and their contacts in space, exact in whole nanometres (ADR 30)."""
