"""How cases are chosen, besides by a design of random numbers: every single fault, or where robustness becomes less."""
