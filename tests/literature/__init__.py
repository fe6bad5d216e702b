"""Cases whose answers are published or follow in closed form, through the public calls."""
