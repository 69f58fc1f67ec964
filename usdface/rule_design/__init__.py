"""Fuzzy rules designed from the expression poses of a rig."""
