"""The HTTP interface, one file per part; each exports ``ROUTES``, which ``application`` joins."""
