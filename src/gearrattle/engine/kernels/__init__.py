"""The basement: compiled loops on floats and arrays. No classes, no units, no input or output, no exceptions."""
