"""One thread for linear algebra in every test process, set before numpy is loaded.

The tests run in as many processes as there are cores; threads of their own would only wait for each
other, and matrices of a hundred rows then take ten times as long.
"""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
