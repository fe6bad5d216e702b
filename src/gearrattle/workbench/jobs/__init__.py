"""Jobs of the workbench: what is computed, in processes of its own, and kept in the workspace folder."""
