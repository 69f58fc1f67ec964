"""The main job on arrays: a shot is assembled, solved and corrected, then measured and reported.

`shot` has the types, `assembly` makes a `Shot`, and `retarget` is the job: `solve`, then `correct`.
A take that is too long for memory goes through `retarget_pieces` and `join_pieces`.
"""
