"""Footage with a known answer: a head with painted dots, filmed by a perspective camera."""
