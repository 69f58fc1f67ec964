"""Binding of markers to vertices of a rig, proposed from their positions and their motion."""
