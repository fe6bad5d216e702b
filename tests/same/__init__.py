"""Two trees side by side: what the one answers otherwise than the other."""
