"""Geometry of point sets and meshes: sizes, rigid fits and modes, normals, units and axes."""
