"""Painted dots in filmed images: found, measured and followed, as arrays."""
