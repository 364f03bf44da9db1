"""Figures, drawn from rows and arrays."""
