"""Reproduction of the paper of 1995: its numbers compared with ours, and the reasons for differences.

C. Padmanabhan, R. C. Barlow, T. E. Rook, R. Singh, "Computational Issues Associated with Gear Rattle Analysis", ASME J.
Mech. Design 117 (1995) 185-192. ``printed_values`` has the numbers in the paper, ``paper_cases`` builds its models
under any mean load, ``measurements`` makes every run once, and every other file compares one table, figure or claim. No
number is adjusted to the paper.

``reproduce`` returns a Reproduction; ``reproduction_page`` presents it.
"""

from gearrattle.reproduction.paper_cases import load_case
from gearrattle.reproduction.procedure import reproduce
from gearrattle.reproduction.reproduction_record import Reproduction, Row, Section

__all__ = ["Reproduction", "Row", "Section", "load_case", "reproduce"]
