"""Numerics that know nothing of faces: blocks and ranges of frames, ramps, maxima, visibility."""
