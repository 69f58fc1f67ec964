"""The inner loops of the solve, compiled by numba: the arithmetic of the numpy forms, fused.

Imported by `usdface.retarget.solver.backend` only, where numba is installed. Machine code is kept
in the user's cache, ``~/.cache/usdface/compiled`` (``NUMBA_CACHE_DIR`` names another place). It is
made once, in five seconds, when a take that is long enough is solved for the first time, or by
``python -c "import usdface.retarget.solver.kernels"``.
"""

from usdface.retarget.solver.kernels.alternation import alternate, factorise
from usdface.retarget.solver.kernels.pivoting import pivot

__all__ = ["alternate", "factorise", "pivot"]
