"""What must hold of every model: invariance, energy, agreement of methods, and the traps of crossing corners."""
