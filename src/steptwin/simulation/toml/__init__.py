"""Keys and values of descriptions, with their places in the text. Sees no other room of the simulation."""
