"""Descriptions read from TOML, and models built from them. Sees all rooms but the running world."""
