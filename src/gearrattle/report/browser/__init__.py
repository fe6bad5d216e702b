"""Drawing of results in a browser, the same on pages of results, in notebooks and in the workbench."""
