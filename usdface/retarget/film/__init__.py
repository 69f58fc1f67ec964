"""Heads before one camera: their pose, the view of each image, the weights that it shows."""
