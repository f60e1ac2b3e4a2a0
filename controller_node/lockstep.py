"""The controller in lockstep: a position waits for the reference of the same stamp."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fjr_interface.topics import SIGNAL_DEPTH, stamp_ns
from fjr_kit.errors import InputError

from .supervised_law import SupervisedLaw


class LockstepController:
    """Pairs positions and references by their stamps; one realization after the other.

    Attributes:
        samples: positions of the run that have come.
        waiting_ns: stamp of the position that waits for its torque; None if none does.
    """

    def __init__(self, law: SupervisedLaw, values: Mapping[str, Any]) -> None:
        """Wait for a run of this law, with checked values of CONTROLLER and SAFETY."""
        self._law = law
        self._references: dict[int, float] = {}
        self._ready = self._replaced = False
        self._begin(values)

    def _begin(self, values: Mapping[str, Any]) -> None:
        self._law.begin_run(values)
        self._rate = values["sample_rate_hz"]
        self._first_ns = self._due_ns = stamp_ns(1, self._rate)
        self._position = 0.0
        self.samples = 0
        self.waiting_ns: int | None = None

    def is_first(self, stamp: int) -> bool:
        """Return whether a position's stamp (ns) is that of a first sample."""
        return stamp == self._first_ns

    def begin_run(self, values: Mapping[str, Any]) -> None:
        """Begin a run whose first position has come; no torque answers until `go_on`.

        Args:
            values: checked values, read anew.
        """
        self._begin(values)
        self._ready = self._replaced = False

    def go_on(self) -> None:
        """Let torques answer: those who must read them are there."""
        self._ready = True

    def leave_run(self) -> bool:
        """Forget the references, for new ones replace them.

        Returns:
            Whether the run is left, too; a first position that overtook its reference stays.
        """
        self._references.clear()
        if self.samples == 1 and self.waiting_ns is not None:
            return False
        self._replaced, self._ready, self.waiting_ns = self.samples > 0, False, None
        return True

    def reference(self, stamp: int, value: float) -> None:
        """Keep a reference for the position of the same stamp (ns)."""
        self._references[stamp] = value

    def position(self, stamp: int, value: float) -> bool:
        """Take a position.

        Returns:
            Whether it is answered; one of a run that new references replace is not.

        Raises:
            InputError: its stamp is not the next one.
        """
        if stamp != self._due_ns:
            raise InputError(
                f"Topic motor_position: stamp {stamp * 1e-9:.6f} s where {self._due_ns * 1e-9:.6f} "
                f"s was due at sample_rate_hz {self._rate:g}; give all nodes the same rate and "
                "start the realization again."
            )
        if self._replaced:
            return False
        self.samples += 1
        self._due_ns = stamp_ns(self.samples + 1, self._rate)
        self.waiting_ns, self._position = stamp, value
        return True

    def answer(self) -> tuple[int, float] | None:
        """Return stamp and torque (N m) if the sample has its position and its reference."""
        if not self._ready or self.waiting_ns is None:
            return None
        stamp, reference = self.waiting_ns, self._references.get(self.waiting_ns)
        if reference is None:
            return None
        self.waiting_ns = None
        torque = self._law.torque(reference, self._position)
        # The latest ones stay: a run that is replaced may have used some of the new one's.
        self._references.pop(stamp_ns(self.samples - SIGNAL_DEPTH, self._rate), None)
        return stamp, torque
