"""What was attacked, how often, and what failed: the page docs/reference/reliability.md."""
