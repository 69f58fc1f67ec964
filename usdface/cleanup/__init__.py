"""Marker clean-up: swaps, spikes and gaps of a take, on arrays."""
