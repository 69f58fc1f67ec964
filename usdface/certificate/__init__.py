"""Certificates of conversions: differences between source and result.

Two evaluations of the same character are compared: one of the source, one of the file that
was written, each by code of its own. Vertices are split and joined on the way, so they are
not compared by number: a vertex is paired with the one of the other side that moves as it
does.
"""
