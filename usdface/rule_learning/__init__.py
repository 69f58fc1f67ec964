"""Fuzzy rules learned from labelled takes."""
