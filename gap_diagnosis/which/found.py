"""What a search over causes of records found, step by step."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..fits.comparison import CellFit


@dataclass
class Found:
    """What the stepwise search found.

    Attributes:
        steps: the refit, then one fit for each cause that was added.
        rivals: fits that were tried at each step, by the number of causes.
        alternatives: for each cause what does as well in its place.
        complete: whether the search ended by itself, not by its budget.
        notes: sentences on what was found but is not named.
        doubted: what was found but is not named, with how surely it is present nevertheless.
    """

    steps: list[CellFit]
    rivals: dict[int, list[CellFit]] = field(default_factory=dict)
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    complete: bool = True
    notes: tuple[str, ...] = ()
    doubted: dict[str, float] = field(default_factory=dict)

    @property
    def best(self) -> CellFit:
        """The last step."""
        return self.steps[-1]
