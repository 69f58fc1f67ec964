"""The setup of one face: binding, neutral, options, pins, the performer's calibration."""
