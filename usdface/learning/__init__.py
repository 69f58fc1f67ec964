"""A fuzzy system learned: from the poses of a rig, or from labelled takes."""
