"""The workbench: a local page on which a driveline is drawn, run, understood, heard, compared and handed over.

``gearrattle serve`` opens it; ``gr.view`` shows the same parts in a notebook. It needs the extra ``workbench``.
"""
