"""Blend shapes: what they are, and where they bring vertices, as immutable arrays in metres."""
