"""Programs of the MIC488 in an editor."""
