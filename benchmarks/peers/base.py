"""What a peer has to offer: a ladder of settings, and a run of so many cycles at one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from benchmarks.peers.plant import Plant


@dataclass(frozen=True)
class Outcome:
    """Deflections of the clearances at the end [half gaps] and how many corners were crossed (-1: not counted)."""

    deflection: Any
    events: int


@dataclass(frozen=True)
class Prepared:
    """A peer ready to run a case: everything that is compiled once is compiled.

    ``run`` takes cycles and starts afresh each time.
    """

    run: Callable[[float], Outcome]


@dataclass(frozen=True)
class Peer:
    """A tool in one formulation.

    ``settings`` is its ladder of (label, keywords), from loose to tight; ``build`` makes a case ready at one of them.
    """

    name: str
    package: str
    formulation: str
    settings: tuple[tuple[str, dict[str, Any]], ...]
    build: Callable[..., Prepared]  # (plant, **keywords)

    @property
    def version(self) -> str | None:
        """Version of the package, None where it is not installed."""
        try:
            return version(self.package)
        except PackageNotFoundError:
            return None

    def prepared(self, plant: Plant, keywords: dict[str, Any]) -> Prepared:
        """Make a case ready."""
        return self.build(plant, **keywords)


def tolerances(*exponents: int, **more: Any) -> tuple[tuple[str, dict[str, Any]], ...]:
    """Return a ladder of tolerances 10^-exponent."""
    return tuple((f"1e-{n:02d}", {"tolerance": 10.0**-n, **more}) for n in exponents)
