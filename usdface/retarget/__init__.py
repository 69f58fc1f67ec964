"""Marker takes to blend shape weights: pure functions of arrays."""
