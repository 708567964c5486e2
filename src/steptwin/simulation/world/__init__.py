"""A running world: model, scripts, actions, history and views. Sees all other rooms."""
