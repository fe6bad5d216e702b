"""The benchmark set in clearance-benchmarks/: who writes its data, who measures. ``make benchmark-set`` runs it."""
