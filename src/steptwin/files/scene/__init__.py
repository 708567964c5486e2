"""The machine in space outside of the studio: recorded while a world runs, as a picture, as a glTF file.

What a machine looks like is known by the page of the studio alone. Its script ``scene.js`` draws in the timeline of a trace, too,
and in pictures, where an engine for JavaScript runs it (ADR 31).
"""
