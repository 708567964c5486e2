"""Simulations of machines: descriptions, and worlds in virtual time that are built from them. Its rooms see only those below."""
