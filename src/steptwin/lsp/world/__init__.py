"""Descriptions of worlds in an editor."""
