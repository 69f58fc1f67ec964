"""Geometry of point sets: sizes, rigid fits, rigid modes."""
