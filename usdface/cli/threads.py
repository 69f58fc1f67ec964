"""How many threads linear algebra takes: one.

The libraries under numpy and scipy take every core for each product and wait for one another by
spinning. The solve has its own threads, one for each core, so they would only be in its way. And
how a product is cut into threads shows in its last bits: the same shot would give other bytes on a
machine with more cores.
"""

import os

__all__ = ["BLAS_THREADS", "one_blas_thread"]

# OpenBLAS (numpy's and scipy's wheels), Intel's MKL, Apple's Accelerate.
BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_blas_thread() -> None:
    """Set it for libraries that are loaded from now on; what the environment says goes first."""
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")
