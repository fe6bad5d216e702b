"""The house rules, as tests: floors, sizes, words, and documents that keep up with the code."""
