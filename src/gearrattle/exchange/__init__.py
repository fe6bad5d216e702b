"""Exchange with other tools: one file for every format."""
