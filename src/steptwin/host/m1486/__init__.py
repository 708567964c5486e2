"""The M1486 driver: chips on one serial line, typed to as the manual has it and verified by echo."""
