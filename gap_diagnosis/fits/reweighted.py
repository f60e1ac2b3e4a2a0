"""Fits beside a remainder: the variance of each cell is what the model itself leaves there.

No model of a real rig leaves noise alone. So the weight of a cell of the evidence is not that of
noise: it is estimated from what the fit leaves on the fitted parts, and the fit is repeated with it
(iteratively reweighted least squares, the maximum-likelihood estimate for unknown variances by
cell). Models are compared by the log-likelihood of parts that no fit has seen. What a cell counts
for is said in `cell_weights`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fjr_kit.least_squares import central_differences, solve
from fjr_sim_node import effects as fx

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..starts.other_splits import other_splits
from ..starts.scales import Scales
from ..starts.search_space import Space
from .comparison import NOTHING_LEFT, CellFit, Comparison

_REFIT_ROUNDS = (8, 5, 5)
_FURTHER = 4  # times that a fit is taken further at the most
_STILL_FALLS = 0.8  # of its misfit
_KEPT = 16  # fits without a cause, each of which holds a Jacobian


class ReweightedFits(Comparison):
    """Fits explanations to the evidence of records, each from a point.

    Attributes:
        nominal: datasheet values of the base parameters.
        tolerance: how far one may be off, relative.
        fit_parts: indices of the parts that are fitted.
        groups: (errors,), the stretch of time of each error of the fit, by its first part.
        runs: (errors,), the record of each error of the fit.
        scales: what is usual in the records.
    """

    def __init__(self, evidence: Evidence, nominal: Mapping[str, float], tolerance: float) -> None:
        """Prepare."""
        super().__init__(evidence)
        self.nominal, self.tolerance = dict(nominal), tolerance
        self.fit_parts = self.weights.fit_parts
        self._taken_out: dict[tuple[Evidence, CellFit, str], CellFit] = {}
        self.groups, self.runs = evidence.stretch_of(self.fit_parts), self.weights.runs
        records = evidence.records
        self.scales = Scales.of_record(
            [r.position for r in records.records],
            [r.torque for r in records.records],
            records.sample_rate_hz,
            evidence.band_hz,
            self.nominal,
        )

    def refit(self) -> CellFit:
        """Fit the base parameters alone, from the datasheet."""
        known = self.evidence.unseen
        space = Space(self.nominal, (), (), self.tolerance, self.scales, known)
        first = self._begun((), space, space.point(Model(self.nominal, {})))
        left = first.solution.residuals / self.weights.weight(first.variance)
        if self.weights.learn(left):
            first = self.further(first)
        return first if self.left_in_a_band(first) < NOTHING_LEFT else self._while_it_falls(first)

    def further(self, fit: CellFit) -> CellFit:
        """Return a fit taken further from where it stands."""
        known = fit.solution.jacobian
        ended = self.reweighted(
            fit.effects, fit.space, fit.solution.x, fit.variance, _REFIT_ROUNDS, known
        )
        return replace(ended, acts=fit.acts)

    def settled(self, fit: CellFit) -> CellFit:
        """Return a fit taken further, unless it then leaves more over noise on unseen parts.

        Weighed by what it leaves, a fit that misses much in one band may give that band up for a
        little less in many others, more so each time.
        """
        further = self.further(fit)
        return fit if self.misfit(further) > self.misfit(fit) else further

    def to_its_end(self, fit: CellFit) -> CellFit:
        """Return a fit taken further while what it leaves over noise still falls.

        Weighed by what itself leaves, a fit may stay where it misses much in a cell, which then
        counts for little. So it is also begun with the weights of noise, and the better one counts.
        """
        fit = self._of_other_split(self._while_it_falls(fit))
        if not self.left_in_a_band(fit) > NOTHING_LEFT:
            return fit
        noise = self.weights.floor
        other = self.reweighted(fit.effects, fit.space, fit.solution.x, noise, _REFIT_ROUNDS)
        return replace(other, acts=fit.acts) if self.gains(other, fit).sum() > 0.0 else fit

    def _of_other_split(self, fit: CellFit) -> CellFit:
        """Return a fit, or a better one with another share of inertia behind the transmission."""
        best = fit
        if not self.left_in_a_band(fit) > NOTHING_LEFT:
            return best
        for effects in other_splits(fit.model.effects):
            start = fit.space.point(Model(fit.model.plant, effects))
            start = np.clip(start, *fit.space.bounds())
            other = replace(self._begun(fit.effects, fit.space, start), acts=fit.acts)
            if self.gains(other, best).sum() > 0.0:
                best = self._while_it_falls(other)
        return best

    def _while_it_falls(self, fit: CellFit) -> CellFit:
        for _ in range(_FURTHER):
            before, fit = fit, self.further(fit)
            if not self.misfit(fit) < _STILL_FALLS * self.misfit(before):
                break
        return fit

    def taken_over(self, fit: CellFit) -> CellFit:
        """Return what the fit of another fitter comes to here, from where it ended there."""
        return self._begun(fit.effects, fit.space, fit.solution.x)

    def without(self, fit: CellFit, effect: str) -> CellFit:
        """Return a fit with one effect taken out and all else fitted anew.

        Its weights begin with what is left where the effect is missing: with those of the fit, the
        cells in which it acts would pull all other parameters away. It begins where all else stood,
        and where, to first order, all else does what the effect did, if that leaves less: of two
        that look alike each is greater by what the other takes away. A ripple that stays is the one
        that it was: with as few cycles as it takes it would be whatever was taken out.

        Search and tests ask for the same more than once, so the latest of these fits are kept.
        """
        key = (self.evidence, fit, effect)
        if key not in self._taken_out:
            self._taken_out[key] = self._fitted_without(fit, effect)
            for oldest in list(self._taken_out)[:-_KEPT]:
                del self._taken_out[oldest]
        return self._taken_out[key]

    def _fitted_without(self, fit: CellFit, effect: str) -> CellFit:
        names = tuple(n for n in fit.space.effects if not n.startswith(f"{effect}."))
        units = tuple(
            u for n, u in zip(fit.space.effects, fit.space.units, strict=True) if n in names
        )
        ripples = {n: fit.model.effects[n] for n in names if fx.parameter(n).role == "cycles"}
        space = replace(fit.space, effects=names, units=units, cycles=ripples)
        rest = tuple(e for e in fit.effects if e != effect)
        begun = [space.point(fit.model), np.clip(_instead(fit, effect), *space.bounds())]
        left = self.residuals(fit.variance, [space.model(point) for point in begun])
        stood, instead = self.weights.costs(fit.variance, left)
        found = self._begun(rest, space, begun[0])
        if not instead < stood:
            return found
        other = self._begun(rest, space, begun[1])
        return other if self.gains(other, found).sum() > 0.0 else found

    def differentiated(self, fit: CellFit) -> CellFit:
        """Return a fit with the Jacobian at its point in place of that of its search."""

        def errors_of(points: np.ndarray) -> np.ndarray:
            return self.residuals(fit.variance, [fit.space.model(point) for point in points])

        jacobian = central_differences(errors_of, fit.solution.x, *fit.space.bounds())
        return replace(fit, solution=replace(fit.solution, jacobian=jacobian))

    def residuals(self, variance: np.ndarray, models: Sequence[Model]) -> np.ndarray:
        """Return the errors of models on the fitted parts, times their weights, (models, errors).

        Args:
            variance: (cells,), of an error in each cell, rad2.
            models: the models.
        """
        return self.evidence.errors(models, self.fit_parts) * self.weights.weight(variance)

    def _begun(self, effects: tuple[str, ...], space: Space, start: np.ndarray) -> CellFit:
        """Return a fit whose weights begin with what its start leaves."""
        errors = self.evidence.errors([space.model(start)], self.fit_parts)[0]
        return self.reweighted(effects, space, start, self.weights.variance(errors), _REFIT_ROUNDS)

    def reweighted(
        self,
        effects: tuple[str, ...],
        space: Space,
        start: np.ndarray,
        variance: np.ndarray,
        rounds: Sequence[int],
        known: np.ndarray | None = None,
    ) -> CellFit:
        """Return a fit that is repeated with the weights of what it leaves.

        Args:
            effects: identifiers, in the order in which they were added.
            space: what is free.
            start: the point in which it begins.
            variance: (cells,), of an error in each cell, with which it begins, rad2.
            rounds: the most steps between one reweighting and the next.
            known: columns of the Jacobian at the start, see `solve`.
        """
        x, solution = start, None
        for steps in rounds:

            def errors_of(points: np.ndarray, variance: np.ndarray = variance) -> np.ndarray:
                return self.residuals(variance, [space.model(point) for point in points])

            solution = solve(errors_of, x, *space.bounds(), most_steps=steps, known=known)
            before = self.weights.weight(variance)
            errors = solution.residuals / before
            variance, x = self.weights.variance(errors), solution.x
            known = solution.jacobian * (self.weights.weight(variance) / before)[:, None]
        assert solution is not None and known is not None
        left = errors * self.weights.weight(variance)
        ended = replace(solution, residuals=left, jacobian=known, cost=float(left @ left))
        model = space.model(x)
        return CellFit(effects, space, model, ended, variance, self.left_by(model, variance))


def _instead(fit: CellFit, effect: str) -> np.ndarray:
    """Return a fit's point less an effect whose work all other parameters do, to first order.

    Args:
        fit: an explanation.
        effect: one of its effects; only its sizes are taken for linear.
    """
    own, x, jacobian = len(fit.space.nominal), fit.solution.x, fit.solution.jacobian
    of_it = np.array([False] * own + [n.startswith(f"{effect}.") for n in fit.space.effects])
    sizes = [own + k for k, n in enumerate(fit.space.effects) if fx.parameter(n).role == "size"]
    gone = [k for k in sizes if of_it[k]]
    step = np.linalg.lstsq(jacobian[:, ~of_it], jacobian[:, gone] @ x[gone], rcond=1e-9)[0]
    return np.asarray(x[~of_it] + step)
