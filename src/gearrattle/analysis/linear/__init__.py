"""What is known of a piecewise system without integrating it in time."""
