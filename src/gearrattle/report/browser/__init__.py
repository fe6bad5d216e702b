"""Results as a browser draws them: the same on pages of results, in notebooks and in the workbench."""
