"""Blend shapes and the vertex positions that they give, as immutable arrays in metres."""
