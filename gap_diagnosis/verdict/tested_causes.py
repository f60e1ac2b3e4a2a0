"""Causes of records and their tests of presence, all others fitted anew without each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..fits.gains import LEAST_GAIN, MOST_P, Gain, beside_others, closed, fall, gain
from ..how_far.ledger import Ledger
from ..outcome.cause import LEAST_PRESENT
from ..outcome.gap_size import Figure
from ..starts.ripples_passed import doubt_of_shape, ripples_passed
from ..which.narrow_band import LINEAR, doubt_of_band, octaves_moved
from ..which.presence import (
    LEAST_INVARIANCE_P,
    SAME_WORTH,
    Invariance,
    at_its_bound,
    beyond_zero,
    cell_estimates,
    invariance,
    over_usual,
)
from ..which.slewing import doubt_of_rate, samples_behind

LEAST_IN_BAND = 0.8
"""Of what is left in its best band, what a cause must close if its share of all is not certain."""
_UNCERTAIN = 0.5  # of what a cause whose size is not certain would be present
_DOUBTED = 0.7  # over what remains: a cause that closes such a share is there as often as not
_LITTLE = 0.2  # of what it closes and what is left: less is there less often than its band says
_IF_NOTHING = 0.75  # of what a cause would be present, where all of that is left
_SMALL = (0.03, 0.1)
"""Shares of the gap: a cause that closes less than the first may be what the form of another one's
law leaves, one that closes more than the second is not..."""
_LEAVES_LITTLE = (0.7, 0.8)
"""...unless what it closes is so much of what is left without it. Of the sure causes of the blind
checks 319 to 329 that closed less than 0.03 of the gap and no more than 0.7 of what was left, 5
were right and 6 wrong; of those that closed more of that, 9 were right and one wrong..."""
_OF_FORM = (0.1, 0.3)
"""...or so much of what another cause does in its band: a law whose form is right to a third leaves
a tenth of that. Of the wrong ones that were looked at anew three close 0.005, 0.02 and 0.15, one
far more; a delay beside Coulomb friction, which is there, closes 0.45."""
_IF_OF_FORM = 0.6  # of what such a cause would be present
_MUCH_LEFT = (0.3, 0.5)
"""Shares of the refit's error, of the motion and over noise alike, between which what an
explanation leaves makes its causes doubtful: of 9 that left more than 0.4 in the blind checks 317
to 320 none was right, of 17 that left 0.2 to 0.4 all but four."""
_IF_MOST = 0.6  # of what a cause would be present, where more than that is left
_UNUSUAL = (1.0, 3.0)  # times the greatest size that machines have, between which a size is doubted
_IF_UNUSUAL = 0.6  # of what a cause of a greater size would be present


@dataclass(frozen=True)
class Tested:
    """A cause and what its tests say.

    Attributes:
        effect: its identifier.
        gain: what leaving it out loses on unseen parts.
        without: the fit that lacks it.
        invariance_p: see `Invariance`; None with one level.
        own_sizes: how much a size of its own at each level would close beyond, of what it closes,
            on unseen parts; 0 where chance explains that sizes differ.
        certain: whether the interval of its size lacks zero.
        bounded: parameter, by its full name, that lies where the fit may go no further, or None.
        share: how much of what the refit left comes back without it, on unseen parts that select.
        left: how much of that is left with it and all others.
        over_noise: how much of what the refit leaves over noise, all errors counting by theirs, is
            left with it and all others; NaN where noise is not known.
        over_noise_closed: how much of what stands out of the noise without it, it closes; NaN where
            noise is not known.
        borne: presence of a cause that modifies it, without which that one is nothing.
        in_band: how much of what is left without it, it closes where it gains most; see `closed`.
        beside_others: how much of what another cause does it closes there; see `beside_others`.
        ripples: how many of its ripples the motion passes; infinite for what has none.
        unusual: its size over the greatest that machines have, see `EffectParameter.usual`.
        behind: how many samples in a row it holds the torque back; infinite for what is no rate.
        octaves: of the motion, where it is a linear law that leaves more than noise; else infinite.
    """

    effect: str
    gain: Gain
    without: CellFit
    invariance_p: float | None
    certain: bool
    bounded: str | None
    share: Figure
    left: float
    in_band: float
    beside_others: float = math.inf
    ripples: float = math.inf
    own_sizes: float = 0.0
    over_noise: float = math.nan
    over_noise_closed: float = math.nan
    borne: float = 0.0
    unusual: float = 0.0
    behind: float = math.inf
    octaves: float = math.inf

    @property
    def passed(self) -> bool:
        """Whether the cause is called present."""
        return self.certain and self.passes_beside_size

    @property
    def passes_beside_size(self) -> bool:
        """Whether it passes all tests but that of its own size, which another cause may blur."""
        least = LEAST_PRESENT if self.certain else _UNCERTAIN * LEAST_PRESENT
        return self.gains_beside_size and self.present >= least

    @property
    def nearly_passes(self) -> bool:
        """Whether nothing is against it but that it is not sure enough, or repeats less often."""
        return self.gains and self.gain.p <= MOST_P

    @property
    def gains_beside_size(self) -> bool:
        """Whether nothing is against it but its size, which its own shape may blur as well.

        Of a ripple of which the motion passes a part, amplitude, cycles and phase blur each other.
        """
        return self.gain.present and self._closes and self.bounded is None and self.invariant

    @property
    def gains(self) -> bool:
        """Whether nothing is against it but that few parts gain, or that it is not sure enough."""
        return self._closes and self._well_known

    @property
    def known_though_it_drifts(self) -> bool:
        """Whether the cause gains; it must gain surely where the squared error grows with it.

        Where a recorded torque drives the model, the drift of that model holds most of the squared
        error, so that a true cause may enlarge it.
        """
        return self._well_known and (self._closes or self.gain.present)

    @property
    def gains_more_often(self) -> bool:
        """Whether it gains where more changes than where it loses, however many parts that are."""
        return self._well_known and self.gain.share > 0.5

    @property
    def _well_known(self) -> bool:
        gains = self.gain.mean > LEAST_GAIN and self.bounded is None
        return gains and self.certain and self.invariant

    @property
    def nearest_kin(self) -> bool:
        """Whether it is not called present only because most of the error stays beside it."""
        alone = self.present / self._beside_much
        passes = self.certain and self.gain.present and self._closes and self.bounded is None
        return passes and self.invariant and self.present < LEAST_PRESENT <= alone

    @property
    def of_another_form(self) -> bool:
        """Whether it is not called present only because its law ends at a limit of its form."""
        there = self.certain and self.gain.present and self._closes and self.invariant
        beside = self.present / _UNCERTAIN >= LEAST_PRESENT
        return there and beside and self.bounded is not None

    @property
    def invariant(self) -> bool:
        """Whether its size may be the same at all levels, or differs by what closes no more."""
        chance = self.invariance_p is None or self.invariance_p >= LEAST_INVARIANCE_P
        return chance or self.own_sizes <= SAME_WORTH

    @property
    def _closes(self) -> bool:
        """Whether some of the gap comes back without it; where one part decides, in its best band.

        Or of what stands out of the noise. Where friction stops a motor is chance, and a few such
        places hold most of a squared error.
        """
        low, high = self.share.low, self.share.high
        if low is None or not low <= 0.0:  # NaN: one part says nothing
            return True
        most = float(np.fmax(self.in_band, self.over_noise_closed))
        return high is not None and high > 0.0 and most >= LEAST_IN_BAND

    @property
    def _beside_much(self) -> float:
        """Factor of the presence of what leaves most of the error, however that is counted.

        The nearest kin of what no effect explains closes a part of it; what is there closes most of
        the motion's error, or most of what stands out of the noise, such as a delay.
        """
        left = float(np.fmin(self.left, self.over_noise))
        return float(np.interp(left, _MUCH_LEFT, (1.0, _IF_MOST)))

    @property
    def present(self) -> float:
        """Probability that it is there.

        A cause that closes little of the gap, and little even in the band where it gains most, may
        be a part of what no effect explains, or of what the law of another cause leaves. Of 11
        causes of the blind checks 307 to 311 that closed less than a quarter of what was left, 6
        were right, stated at 0.79 in the mean. One part may hold most of the squares even in that
        band, so what stands out of the noise counts as well, by half.
        """
        sure = (1.0 - min(1.0, 5.0 * self.gain.p)) * min(1.0, self.gain.share + 0.1)
        of_all = self.share.low if self.share.low is not None and self.share.low > 0.0 else 0.0
        of_both = 0.5 * (self.in_band + self.over_noise_closed)
        closed = max(float(np.fmax(self.in_band, of_both)), of_all, 0.0)
        sure *= closed / (closed + _DOUBTED * (1.0 - closed))
        share = max(0.0, self.share.value)
        beside_left = share / max(share + self.left, 1e-300)
        beside_left = float(np.fmax(beside_left, self.over_noise_closed))
        sure *= _IF_NOTHING + (1.0 - _IF_NOTHING) * min(beside_left / _LITTLE, 1.0)
        sure *= self._beside_much
        beyond_form = max(
            np.interp(share, _SMALL, (0.0, 1.0)),
            np.interp(beside_left, _LEAVES_LITTLE, (0.0, 1.0)),
            np.interp(self.beside_others, _OF_FORM, (0.0, 1.0)),
        )
        sure *= _IF_OF_FORM + (1.0 - _IF_OF_FORM) * float(beyond_form)
        sure *= doubt_of_shape(self.ripples) * doubt_of_rate(self.behind)
        sure *= doubt_of_band(self.octaves)
        sure *= float(np.interp(self.unusual, _UNUSUAL, (1.0, _IF_UNUSUAL)))
        if not self.certain or self.bounded is not None:
            sure *= _UNCERTAIN
        if not self.invariant:
            sure *= 0.5
        return max(min(sure, 0.99), self.borne)


def causes_with_tests(
    fitter: CellFitter, fit: CellFit, refit: CellFit, scatter: Mapping[str, float]
) -> list[Tested]:
    """Return every cause of a fit with its tests, all others fitted anew without it.

    Args:
        fitter: of the search.
        fit: with the causes.
        refit: of the base parameters alone.
        scatter: of parameters from run to run, see `moved_by_scatter`.
    """
    ledger = Ledger(fitter.evidence, fitter.select_parts)
    fewer = {effect: fitter.without(fit, effect) for effect in fit.effects}
    estimates = cell_estimates(fit, fitter, scatter, fewer)
    squares = [float(ledger.squares(each.model).sum()) for each in (fit, refit)]
    left = squares[0] / max(squares[1], 1e-300)
    over_noise = _left_over_noise(fitter, fit, refit)
    octaves = octaves_left(fitter, fit)
    found = []
    for effect, without in fewer.items():
        sizes = invariance(fitter, fit, effect, scatter)
        found.append(
            Tested(
                effect,
                gain(fitter, fit, without, fitter.acted(fit, effect)),
                without,
                None if sizes is None else sizes.p,
                beyond_zero(effect, estimates, fall(fitter, fit, without)),
                at_its_bound(fit, effect),
                ledger.share(without.model, fit.model, refit.model),
                left,
                closed(fitter, fit, without),
                beside_others(
                    fitter, fit, without, [f for f in fewer.values() if f is not without]
                ),
                ripples_passed(fit.model, effect, fitter.scales),
                _own_sizes(ledger, fit, without, sizes),
                over_noise,
                1.0 - _left_over_noise(fitter, fit, without),
                unusual=over_usual(fit.model, effect),
                behind=samples_behind(fit.model, effect, fitter.evidence.records),
                octaves=octaves if effect in LINEAR else math.inf,
            )
        )
    return found


def octaves_left(fitter: CellFitter, fit: CellFit) -> float:
    """Return the octaves of the motion; infinite where a fit leaves noise, or none is compared."""
    evidence = fitter.evidence
    if evidence.slow or evidence.records.swings_free or fitter.misfit(fit) < NOTHING_LEFT:
        return math.inf
    return octaves_moved(evidence.records)


def _left_over_noise(fitter: CellFitter, after: CellFit, before: CellFit) -> float:
    """Return how much of what one fit leaves over noise another leaves; NaN where nothing is."""
    left, whole = (max(fitter.misfit(each) - 1.0, 0.0) for each in (after, before))
    return left / whole if whole > 0.0 else math.nan


def _own_sizes(ledger: Ledger, fit: CellFit, without: CellFit, sizes: Invariance | None) -> float:
    """Return what `Tested.own_sizes` is."""
    if sizes is None or sizes.p >= LEAST_INVARIANCE_P:
        return 0.0
    common, bare = ledger.squares(fit.model), ledger.squares(without.model)
    level = np.array([ledger.evidence.parts[p].level for p in ledger.parts])
    beyond = 0.0
    for one, model in sizes.own.items():
        beyond += float((common - ledger.squares(model))[level == one].sum())
    return beyond / max(float((bare - common).sum()), 1e-300)
