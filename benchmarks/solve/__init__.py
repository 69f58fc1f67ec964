"""The ground-truth benchmark of the solve: `usdface bench solve`."""
