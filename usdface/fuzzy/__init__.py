"""The fuzzy-logic expression layer: pure functions of arrays."""
