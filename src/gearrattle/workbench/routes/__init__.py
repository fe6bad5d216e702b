"""The HTTP interface, one file a part; each exports ``ROUTES``, which ``application`` joins."""
