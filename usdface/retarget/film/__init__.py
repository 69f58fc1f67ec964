"""Takes of one camera: the head's pose, the view of each image, and weights by these views."""
