"""The solve on takes of known weights, beside other solvers: `python -m benchmarks.solve`."""
