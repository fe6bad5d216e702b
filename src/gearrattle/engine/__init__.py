"""The mathematics: compiled loops (``kernels``), the piecewise-linear system (``system``), algorithms (``solvers``)."""
