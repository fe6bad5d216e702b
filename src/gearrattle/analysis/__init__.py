"""What a model tells without a run: rest, modes, stiffness, scales, contact ratios, the static loop of an element."""
