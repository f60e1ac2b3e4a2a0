"""How large each effect of the catalogue must be for a diagnosis to name it.

An effect is tried in every shape in which fits begin (`search_space.starts`), scaled up or down as
a whole. What a refit of the bare parameters leaves of its change is compared with what the
diagnosis needs. Shapes are compared by the slope of their start; the size at which the most and the
least visible of them is just named is then searched for, the refit carried out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_kit.showing import BareRefit, size_showing
from fjr_sim_node import effects as fx

from ..model.rig_model import Model
from ..outcome.verdict_words import ROUNDING
from ..starts.candidates import by_shape
from ..starts.search_space import beside, starts
from .bare_parameters import left_by_refit
from .foreseen import ForeseenEffect
from .sight import Sight

_MOST = 20.0  # times what the slope of a shape promises
_LOOSE, _TIGHT = 5.0, 0.02  # limits of a drive that are tried, times the greatest torque
_REFITTED = 0.9  # of what slopes promise must be left by a refit for them to count
_TOLD = 0.5  # of an effect that another one must leave to be told from it, up to twice the limit
_NEARER = 10.0  # times what slopes promise
_NEAR = 0.1  # logarithm of the factor within which the end of a range is found
_SCALED = ("size", "harmonic")

_SEEN_DIRECTLY = "Seen in the samples themselves, as soon as one count exceeds the noise."
_ONLY_A_GATE = "A gate looks for it between runs, no fit does."
_TOO_SMALL = "It does not show at any size that a fit may take and that can be simulated."
_TOO_STIFF = "Beside this nominal it moves too fast to be simulated at the rate of the samples."


@dataclass(frozen=True)
class Shape:
    """One shape of an effect.

    Attributes:
        seed: parameters of its start, by full name.
        lead: which of them is the leading one.
        slope: what a refit leaves of the start's change, (errors,).
        strength: how far that shows, over what is needed.
    """

    seed: Mapping[str, float]
    lead: str
    slope: np.ndarray
    strength: float

    def at(self, factor: float) -> dict[str, float]:
        """Return the parameters with the effect larger by a factor; a limit is then lower."""
        return {name: _scaled(name, value, factor) for name, value in self.seed.items()}


@dataclass(frozen=True)
class Limit:
    """A shape at the size at which it is just named, and what a refit leaves there, (errors,)."""

    shape: Shape
    factor: float
    left: np.ndarray

    @property
    def value(self) -> float:
        """The leading parameter, in its unit."""
        return _scaled(self.shape.lead, self.shape.seed[self.shape.lead], self.factor)


def _scaled(name: str, value: float, factor: float) -> float:
    role = fx.parameter(name).role
    if role in _SCALED:
        return value * factor
    return value / factor if role == "limit" else value


class EffectLimits:
    """Detection limits of effects beside one bare plant."""

    def __init__(
        self, sight: Sight, nominal: Model, refit: BareRefit, showing: float = 1.0
    ) -> None:
        """Take what the experiment shows, the bare plant and what its refit takes over.

        Args:
            sight: of the experiment.
            nominal: the bare plant.
            refit: of it.
            showing: how many times as much as it needs to be named a limit shows.
        """
        self._sight, self._nominal, self._refit = sight, nominal, refit
        self._showing = showing
        self._bare = sight.errors([nominal])[0]
        self._shapes: dict[str, list[Shape]] = {}
        self._limits: dict[str, Limit] = {}

    def find(self, effect: str) -> ForeseenEffect:
        """Return the detection limit of an effect, without what it could be taken for."""
        why = _beforehand(effect)
        parameter = fx.EFFECTS[effect].size_names[0]
        if why:
            return _without(effect, parameter, why)
        shapes = self._shapes[effect] = self._screened(effect)
        if not shapes:
            return _without(effect, parameter, _TOO_STIFF)
        order = sorted(shapes, key=self._promise)
        best = next((found for s in order[:3] if (found := self._limit(s))), None)
        if best is None:
            return _without(effect, parameter, _TOO_SMALL)
        self._limits[effect] = best
        last = order[-1]
        worst = best if last is best.shape else self._limit(last)
        if worst is not None and _farther(best.shape.lead, worst.value, best.value):
            best, worst = worst, best
        shape = {
            name: value for name, value in best.shape.at(best.factor).items()
            if name != best.shape.lead and value
        }  # fmt: skip
        return ForeseenEffect(
            effect=effect,
            parameter=best.shape.lead,
            unit=fx.parameter(best.shape.lead).unit,
            limit=best.value,
            limit_worst=None if worst is None else worst.value,
            shape=shape,
            level=self._sight.levels[self._sight.best_level(best.left)],
        )

    def not_told_from(self, effect: str) -> list[str]:
        """Return the effects that could stand for one, among those whose shapes are known.

        Beside the bare parameters, a rival takes over the share of the effect that lies along it;
        ripples a quarter turn apart do so together. Near equivalents of the catalogue that are
        among them stand first.
        """
        if effect not in self._limits:
            return []
        left = self._limits[effect].left
        near = fx.near_equivalents(effect)
        rivals = [
            rival for rival, shapes in self._shapes.items()
            if rival != effect and self._rest(left, rival, shapes) < _TOLD
        ]  # fmt: skip
        return sorted(rivals, key=lambda rival: rival not in near)

    def _rest(self, left: np.ndarray, rival: str, shapes: Sequence[Shape]) -> float:
        """Return which share of what an effect leaves a rival cannot take over."""
        slopes = np.array([shape.slope for shape in shapes])
        groups = [slopes[members].T for members in by_shape([s.seed for s in shapes]).values()]
        if rival in self._limits:
            groups.append(self._limits[rival].left[:, None])
        total = float(left @ left)
        rests = [1.0]
        for group in groups:
            taken = group @ np.linalg.lstsq(group, left, rcond=1e-9)[0]
            rests.append(math.sqrt(max(1.0 - float(taken @ taken) / total, 0.0)))
        return min(rests)

    def _screened(self, effect: str) -> list[Shape]:
        """Return the shapes of an effect, each from the start whose slope tells its limit best."""
        every = starts(effect, self._sight.scales, nominal=self._nominal.plant)
        seeds = [one for one in every if not self._sight.too_stiff(beside(self._nominal, one))]
        if not seeds:
            return []
        changes = self._sight.errors([beside(self._nominal, seed) for seed in seeds]) - self._bare
        found: dict[tuple, Shape] = {}
        for seed, change in zip(seeds, changes, strict=True):
            lead = next(n for n in fx.EFFECTS[effect].size_names if seed.get(n))
            slope = self._refit.left(change)
            shape = Shape(seed, lead, slope, self._sight.strength(slope))
            key = tuple(
                (n, v / seed[lead] if fx.parameter(n).role in _SCALED else v)
                for n, v in seed.items() if n != lead
            )  # fmt: skip
            rival = found.get((lead, key))
            if rival is None or _from_limit(shape) < _from_limit(rival):
                found[(lead, key)] = shape
        return list(found.values())

    def _promise(self, shape: Shape) -> float:
        """Return the limit that a shape's slope promises, over its scale.

        That of a drive's limit is the smaller the sooner it shows.
        """
        if not shape.strength:
            return math.inf
        start = shape.seed[shape.lead] / self._sight.scales.of(shape.lead)
        value = _scaled(shape.lead, start, self._showing / shape.strength)
        return 1.0 / value if fx.parameter(shape.lead).role == "limit" else abs(value)

    def _limit(self, shape: Shape) -> Limit | None:
        """Return where a shape is just named; None if that is at no size a fit may take."""
        if not shape.strength:
            return None
        least, most = self._range(shape)
        if fx.parameter(shape.lead).role != "limit":  # a limit is felt from one size on
            most = min(most, _MOST * max(self._showing / shape.strength, least))
        ends = least, most = self._followed(shape, least), self._followed(shape, most)
        slopes = self._searched(shape, self._showing / shape.strength, ends, self._by_slopes)
        if slopes is None:
            return None
        factor = max(slopes, least)
        left = self._by_refit(shape, factor)
        shown = self._sight.strength(left) / self._showing
        if not _REFITTED < shown * slopes / factor < 1.0 / _REFITTED:
            # at its end a range may be beyond what shows: friction does what a wide dead band does
            nearer = least, min(most, _NEARER * slopes)
            tried = (self._searched(shape, slopes, r, self._by_refit) for r in (ends, nearer))
            found = next((factor for factor in tried if factor is not None), None)
            if found is None:
                return None
            factor = max(found, least)
            left = self._by_refit(shape, factor)
        return Limit(shape, factor, left)

    def _followed(self, shape: Shape, end: float) -> float:
        """Return a factor, or the one nearest to it at which the motion can be followed.

        A start can be; so it is searched for between 1 and that end.
        """
        if not self._sight.too_stiff(beside(self._nominal, shape.at(end))):
            return end
        good, bad = 1.0, end
        while abs(math.log(bad / good)) > _NEAR:
            middle = math.sqrt(good * bad)
            stiff = self._sight.too_stiff(beside(self._nominal, shape.at(middle)))
            good, bad = (good, middle) if stiff else (middle, bad)
        return good

    def _searched(
        self,
        shape: Shape,
        start: float,
        ends: tuple[float, float],
        left: Callable[[Shape, float], np.ndarray],
    ) -> float | None:
        least, most = ends

        def shown(factor: float) -> float:
            """Return how far it shows; below what counts as off, in proportion."""
            played = max(factor, least)
            return self._sight.strength(left(shape, played)) * factor / played

        return size_showing(shown, self._showing, start, most)

    def _by_slopes(self, shape: Shape, factor: float) -> np.ndarray:
        return self._refit.left(self._with(shape, factor) - self._bare)

    def _by_refit(self, shape: Shape, factor: float) -> np.ndarray:
        return left_by_refit(self._sight, self._refit, self._with(shape, factor))

    def _with(self, shape: Shape, factor: float) -> np.ndarray:
        return self._sight.errors([beside(self._nominal, shape.at(factor))])[0]

    def _range(self, shape: Shape) -> tuple[float, float]:
        """Return the least factor on a start that counts as on, and the greatest within bounds."""
        least, most = 0.0, math.inf
        for name, value in shape.seed.items():
            role, (low, high) = fx.parameter(name).role, self._sight.scales.bounds(name)
            if value and role in _SCALED:
                least = max(least, self._sight.scales.negligible(name) / abs(value))
                most = min(most, (high if value > 0.0 else low) / value)
            elif value and role == "limit":
                scale = self._sight.scales.of(name)
                least = max(least, value / min(high, _LOOSE * scale))
                most = min(most, value / max(low, _TIGHT * scale))
        return least, most


def _from_limit(shape: Shape) -> float:
    """Return how far a shape's start is from where it is just named, as a logarithm."""
    return abs(math.log(shape.strength)) if shape.strength else math.inf


def _farther(lead: str, one: float, other: float) -> bool:
    """Tell whether an effect of one value is smaller than one of another."""
    smaller = abs(one) < abs(other)
    return smaller is not (fx.parameter(lead).role == "limit") and one != other


def _beforehand(effect: str) -> str:
    """Return why an effect has no detection limit; empty if it may have one."""
    entry = fx.EFFECTS[effect]
    if effect == ROUNDING:
        return _SEEN_DIRECTLY
    if not entry.starts:
        return _ONLY_A_GATE
    if entry.scales == "everywhere":
        return f"It is exactly {entry.same_as}."
    return ""


def _without(effect: str, parameter: str, why: str) -> ForeseenEffect:
    return ForeseenEffect(
        effect=effect, parameter=parameter, unit=fx.parameter(parameter).unit, why_not=why
    )
