"""Numerics that know nothing of faces: blocks of frames, ramps, maxima, visibility patterns."""
