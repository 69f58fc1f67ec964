"""Figures (matplotlib, the extra `plot`)."""
