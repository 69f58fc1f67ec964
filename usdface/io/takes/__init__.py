"""Readers of takes: C3D, TRC, CSV, BVH, Live Link Face, USD."""
