"""The Runge-Kutta kernels against the same in C, compiled by whatever ``cc`` this machine has."""
