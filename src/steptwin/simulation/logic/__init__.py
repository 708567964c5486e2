"""Expressions and conditions, signals, contacts and sources at inputs. Sees mechanics and what is below it."""
