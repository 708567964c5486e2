"""A running world: model, scripts, actions, snapshots and views. Sees all other rooms."""
