"""Compute all outcomes, or those of the rows named, and write them into the manual."""

from __future__ import annotations

import sys

from tests.compositions.kinds import KINDS
from tests.compositions.table import ROWS, kept, outcomes, write

if __name__ == "__main__":
    rows = sys.argv[1:] or list(ROWS)
    actual = {} if rows == list(ROWS) else kept()
    for kind in KINDS:
        print(kind, file=sys.stderr)
        for row, outcome in outcomes(kind, rows).items():
            actual.setdefault(row, {})[kind] = outcome
    write({row: actual[row] for row in ROWS})
