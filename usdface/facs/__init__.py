"""Blend shapes, poses and peaks judged by the action units of FACS."""
