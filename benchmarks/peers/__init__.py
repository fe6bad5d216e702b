"""``exact`` against the tools people would use today, in one run: ``make peers`` writes docs/reference/peers.md."""
