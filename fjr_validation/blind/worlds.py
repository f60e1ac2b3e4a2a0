"""Cases of the three worlds, each drawn from (seed, number, world) alone.

closed    multisines; nothing but effects of the catalogue is there: none, one or two
open      multisines; every rig has a remainder, and beside it one cause, two, or none
records   a remainder as well, under chirps, noise, trapezoidal moves or steps, from rest
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter
from fjr_kit.atomic import new_folder, write_whole
from fjr_kit.showing import size_showing

from .answers import WORLDS, Answer, Cause, Kind, World
from .causes import compatible, drawers
from .draw import Draw
from .remainders import SCATTER, laws
from .rigs import log_uniform
from .stage import Stage, Unsuitable, datasheet, draw_stage, without
from .visibility import Visibility

KINDS: Mapping[World, Mapping[Kind, float]] = {
    "closed": {"none": 0.15, "single": 0.6, "two": 0.25},
    "open": {"remainder": 0.2, "single": 0.45, "two": 0.25, "outside": 0.1},
    "records": {"remainder": 0.2, "single": 0.65, "outside": 0.15},
}
"""Share of each kind of case."""
RELATIVE = (3.2, 30.0)
"""Range of how far a closed world's cause shows, over what its detection limit shows."""
DOMINANT = {"single": (3.3, 12.0), "two": (3.3, 8.0), "outside": (3.3, 12.0)}
"""Range of a cause over the remainder, both as they show after a linear refit."""
_LAW = (2e-3, 1.5e-2)  # rms of a weak law's change over the position's
_WEAK = (1e-3, 5e-3)  # of a weak effect of the catalogue
_WEAK_SHARE = 0.5
_LARGEST = 0.6  # of a dominant cause
_ATTEMPTS = 60
_AFTER_REFIT = 0.7  # of what linear slopes promise must be left by a full refit


@dataclass(frozen=True)
class _Sized:
    """An effect with its size."""

    draw: Draw
    settings: Mapping[str, float]


def kind_of(seed: int, number: int, world: World) -> Kind:
    """Return what a case holds."""
    rng = np.random.default_rng([seed, WORLDS.index(world), number])
    kinds = KINDS[world]
    return list(kinds)[int(rng.choice(len(kinds), p=list(kinds.values())))]


def make_case(
    seed: int, number: int, world: World, folder: Path, *, open_answer: bool = True
) -> Answer:
    """Write bags and datasheet of a case into a new folder; return its answer.

    Args:
        seed: of the check.
        number: of the case.
        world: closed, open or records.
        folder: which must not exist.
        open_answer: whether `answer.json` is written beside them.
    """
    for attempt in range(_ATTEMPTS):
        try:
            case = _Case((seed, WORLDS.index(world), number, attempt), world,
                         kind_of(seed, number, world))  # fmt: skip
            with new_folder(folder) as hidden:
                answer = case.write(hidden)
                if open_answer:
                    write_whole(hidden / "answer.json", json.dumps(answer.to_json(), indent=2))
            return answer
        except Unsuitable:
            continue
    raise RuntimeError(f"case {number} of seed {seed}, {world}: nothing suitable was drawn")


class _Case:
    """One case: stage, effects and their sizes."""

    def __init__(self, seed: tuple[int, ...], world: World, kind: Kind) -> None:
        self._world, self._kind = world, kind
        self._rng = np.random.default_rng([*seed, 2])
        stage = draw_stage(seed, periodic=world != "records")
        self._order = self._drawn(stage)
        chosen = self._order[: {"single": 1, "two": 2}.get(kind, 0)]
        self._lacking = tuple(name for draw in chosen for name in draw.lacking)
        self._stage = stage = without(stage, self._lacking)
        self._visibility = Visibility(
            stage.excitation.firsts, stage.positions, stage.plant, stage.noise_rad
        )
        self._laws: list[_Sized] = []
        self._weak: list[_Sized] = []
        self._scatter = 0.0
        if world == "closed":
            self._causes = self._closed(len(chosen))
        else:
            self._causes = self._beside_remainder(len(chosen))

    def _drawn(self, stage: Stage) -> list[Draw]:
        """Return draws of causes in a random order; the first are those of the case."""
        every = drawers(rigid=stage.rig.rigid, stationary=self._world != "closed")
        order = self._rng.permutation(len(every))
        return [every[index](self._rng, stage.scales) for index in order]

    def _closed(self, count: int) -> list[_Sized]:
        wanted = [log_uniform(self._rng, *RELATIVE) for _ in range(count)]
        return self._found(self._order, wanted, self._visibility.relative, RELATIVE[0])

    def _beside_remainder(self, count: int) -> list[_Sized]:
        rng = self._rng
        self._scatter = log_uniform(rng, *SCATTER)
        every = laws(rigid=self._stage.rig.rigid)
        outside = [every[i](rng, self._stage.scales) for i in rng.permutation(len(every))]
        weak = [log_uniform(rng, *_LAW) for _ in range(int(rng.integers(1, 3)))]
        self._laws = self._found(outside, weak, self._left)
        if count and rng.random() < _WEAK_SHARE:
            rest = [draw for draw in self._order[count:] if not draw.lacking]
            names = [draw.name for draw in self._order[:count]]
            rest = [draw for draw in rest if compatible(names, draw.name)]
            self._weak = self._found(rest, [log_uniform(rng, *_WEAK)], self._left)
        remainder = self._remainder()
        low, high = DOMINANT.get(self._kind, (1.0, 1.0))
        most = _LARGEST / remainder
        if self._kind != "remainder" and most < low:
            raise Unsuitable("the remainder is too large")
        draws = self._order
        if self._kind == "outside":
            used = {law.draw.name for law in self._laws}
            draws, count = [draw for draw in outside if draw.name not in used], 1
        wanted = [log_uniform(rng, low, min(high, most)) for _ in range(count)]

        def shown(change: np.ndarray) -> float:
            """Return the change over the remainder, less if noise hides it."""
            clear = self._visibility.relative(change) / RELATIVE[0]
            return min(self._left(change) / remainder, low * clear)

        return self._found(draws, wanted, shown, low)

    def _left(self, change: np.ndarray) -> float:
        return self._visibility.share(self._visibility.left(change))

    def _found(
        self,
        draws: Sequence[Draw],
        wanted: Sequence[float],
        shown: Callable[[np.ndarray], float],
        least: float | None = None,
    ) -> list[_Sized]:
        """Return as many effects as are wanted, each showing as much as is wanted.

        An effect that cannot show as much is taken at its greatest size if it then shows `least`,
        else the next one is tried. One that the datasheet lacks must be the one that was planned.
        """
        found: list[_Sized] = []
        used = [part.draw.name for part in self._weak]
        for target in wanted:
            for draw in draws:
                names = [*used, *(part.draw.name for part in found)]
                if not compatible(names, draw.name) or (draw.lacking and not self._lacks(draw)):
                    continue
                size = self._size(draw, target, shown, least)
                if size is not None:
                    found.append(_Sized(draw, draw.settings(size)))
                    break
                if draw.lacking:
                    raise Unsuitable(f"{draw.name} does not show")
            else:
                raise Unsuitable("nothing shows")
        return found

    def _lacks(self, draw: Draw) -> bool:
        return set(draw.lacking) <= set(self._lacking)

    def _size(
        self, draw: Draw, target: float, shown: Callable[[np.ndarray], float], least: float | None
    ) -> float | None:
        def at(size: float) -> float:
            try:
                change = self._visibility.change(self._stage.plant, draw.settings(size))
            except Unsuitable:
                return math.inf
            return shown(change)

        size = size_showing(at, target, draw.start, draw.most)
        if size is None and least is not None and at(draw.most) >= least:
            size = draw.most
        if size is None:
            return None
        with_it = self._stage.positions(self._stage.plant, draw.settings(size), 0.0)
        left = self._visibility.left_by_refit(with_it, self._bare)
        return size if shown(left) >= _AFTER_REFIT * min(target, at(size)) else None

    def _bare(self, plant: Mapping[str, float]) -> list[np.ndarray]:
        return self._stage.positions(plant, {}, 0.0)

    def _settings(self, parts: Sequence[_Sized]) -> dict[str, float]:
        """Return the settings of effects together."""
        together: dict[str, float] = {}
        for part in parts:
            together |= part.settings
        return together

    def _positions(self, parts: Sequence[_Sized], scatter: float) -> list[np.ndarray]:
        return self._stage.positions(self._stage.plant, self._settings(parts), scatter)

    def _remainder(self) -> float:
        """Return how much the remainder alone shows after a refit."""
        with_it = self._positions([*self._laws, *self._weak], self._scatter)
        return self._left(self._visibility.between(with_it, self._positions([], 0.0)))

    def write(self, folder: Path) -> Answer:
        """Play and write all runs and the datasheet; return the answer."""
        stage = self._stage
        every = [*self._causes, *self._laws, *self._weak]
        settings = self._settings(every)
        for run in stage.excitation.runs:
            record = stage.record(run, stage.plant, settings, scatter=self._scatter, noisy=True)
            bag = bag_folder(folder, run.level, run.description.realization)
            with BagWriter(bag, run.description) as writer:
                writer.write_arrays(r=run.reference, y=record.y, u=record.u)
        nominal = datasheet(self._rng, stage.plant, self._lacking)
        write_whole(folder / "nominal.yaml", _parameter_file(nominal))
        return self._answer(every, nominal, settings)

    def _answer(
        self, every: Sequence[_Sized], nominal: Mapping[str, float], settings: Mapping[str, float]
    ) -> Answer:
        stage, between = self._stage, self._visibility.between
        full = self._positions(every, self._scatter)
        gap = self._left(between(full, self._positions([], 0.0)))
        rest = between(full, self._positions(self._causes, 0.0))

        def cause(part: _Sized) -> Cause:
            others = [other for other in every if other is not part]
            settings = self._settings(others)
            change = between(full, self._positions(others, self._scatter))
            left = self._visibility.left_by_refit(
                full, lambda plant: stage.positions(plant, settings, self._scatter)
            )
            beside = self._world != "closed"
            return Cause(
                part.draw.name,
                self._visibility.relative(left),
                self._visibility.share(left) / self._left(rest) if beside else None,
                self._visibility.share(change) / self._visibility.share(rest) if beside else None,
                self._visibility.share(left) / gap,
                part.draw.truth(part.settings),
            )

        return Answer(
            world=self._world,
            kind=self._kind,
            causes=tuple(cause(part) for part in self._causes),
            weak=tuple(cause(part) for part in self._weak),
            laws=tuple(part.draw.name for part in self._laws),
            plant=stage.plant,
            nominal=nominal,
            settings=settings,
            noise_rad=stage.noise_rad,
            scatter=self._scatter,
            remainder=self._left(rest),
            excitation=stage.excitation.kind,
            controller_known=stage.excitation.runs[0].description.controller is not None,
            facts=stage.facts,
        )


def _parameter_file(nominal: Mapping[str, float]) -> str:
    lines = [f"    {name}: {'.inf' if math.isinf(v) else repr(v)}" for name, v in nominal.items()]
    return "\n".join(["/rig/simulator:", "  ros__parameters:", *lines]) + "\n"
