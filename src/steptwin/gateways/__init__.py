"""Gateways: protocols through which other programs see a subject, by its static description alone.

Each has a folder here, with its options and what serves them; `steptwin.gateways.kinds` lists them.
"""
