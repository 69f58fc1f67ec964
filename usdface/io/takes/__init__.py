"""Readers of takes: C3D, TRC, BVH, USD, tables, and exports of other programs."""
