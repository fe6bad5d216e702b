"""Analyses of a model without a run: equilibrium, modes, stiffness, scales, contact ratios, static torque loops."""
