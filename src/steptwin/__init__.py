"""steptwin: the WObit MIC488 and the Microcon M1486 motion controllers as software."""

__version__ = "0.1.0"
