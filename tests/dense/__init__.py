"""Ten thousand random drivelines against a dense check in coordinates of its own."""
