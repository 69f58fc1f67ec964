"""Recorded takes in: C3D, TRC, CSV, BVH, Live Link Face."""
