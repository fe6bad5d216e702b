"""What composes with what: every public call and every command on every kind of model the file format knows."""
