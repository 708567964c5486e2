"""Campaigns: many runs of one world, each a little different, and what must hold in all of them."""
