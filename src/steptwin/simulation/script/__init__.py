"""Steps of scripts, commands and dead-man jogs as values. Sees faults and what is below them."""
