"""Numerics that know nothing of faces: frame blocks and ranges, ramps, visibility patterns."""
