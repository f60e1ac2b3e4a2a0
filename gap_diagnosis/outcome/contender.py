"""An explanation that a verdict chose among, as diagnosis.json holds it."""

from __future__ import annotations

from fjr_kit.result_types import OptionalNumber, ResultModel


class Contender(ResultModel):
    """One of the explanations that the verdict chose among.

    Attributes:
        effects: all of them.
        held_out_chi2: misfit on the data that select, which are not those of `steps`.
        gain: log-likelihood that it gains on a block of these data over the chosen explanation,
            nats; less than 0 where it predicts worse.
        better: whether that gain repeats too surely to be chance.
        converged: whether the fit did.
    """

    effects: list[str]
    held_out_chi2: OptionalNumber
    gain: OptionalNumber
    better: bool = False
    converged: bool
