"""Clean-up, solve and calibration of a take on a bound face: retarget without correction."""
