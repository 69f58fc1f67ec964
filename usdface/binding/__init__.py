"""Where markers sit on a rig, proposed from their shape and their motion."""
