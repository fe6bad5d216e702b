"""What moves with a second number of the driveline: events, their gradients, and where two of them meet."""
