"""The rules of the project, as tests: layers, sizes, words, and documents that keep up with the code."""
