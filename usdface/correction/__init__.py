"""The expression layer at work: features read off a face, and poses blended over solved weights."""
