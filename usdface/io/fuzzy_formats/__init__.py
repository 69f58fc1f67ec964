"""Fuzzy systems in the text formats of other programs: MATLAB .fis, FCL and FLL."""
