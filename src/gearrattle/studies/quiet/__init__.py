"""Proven quiet: where in a box of parameters a quiet motion exists and is stable."""

from gearrattle.studies.quiet.proof import QuietProof
from gearrattle.studies.quiet.prove import prove_quiet

__all__ = ["QuietProof", "prove_quiet"]
