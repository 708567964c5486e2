"""Programs of the M1486 in an editor."""
