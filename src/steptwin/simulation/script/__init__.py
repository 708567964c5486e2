"""Steps of scripts, commands and held jogs as values. Sees faults and what is below them."""
