"""Jobs of the workbench: computations in separate processes, whose results are kept in the workspace folder."""
