"""Event schedulers in virtual time, wires, parts and records of what happens. Sees `toml`."""
