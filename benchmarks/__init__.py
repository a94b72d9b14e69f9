"""How fast, how small and how good, beside the peers, in the same run; see README.md."""

import os

# CPU time is what counts, and threads of a BLAS spin while they wait. To be set before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
