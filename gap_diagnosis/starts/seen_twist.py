"""Play and stiffness, seen in the twist of a transmission whose link has an encoder.

How far the twist goes is the play and what the spring gives; how much of it is play is tried.

What the transmission passes on is the motor's torque less what accelerates the motor and what its
friction takes. Over a spring behind play the twist is

    q - y = -tau/k - g sign(tau),   tau = u - jm y'' - fs sign(y')

beside what two encoders differ by, which goes with 1, q and q' (`twist`), and is linear in 1/k,
jm/k, fs/k and g but for sign(tau), which is taken from the solution before. A fit whose spring is
bent to do what play does seldom gets from there to both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import savgol_filter

from ..model.evidence import Evidence
from ..model.rig_model import Model

PLAYS = {
    "backlash": lambda gap: {"backlash.half_gap_rad": gap},
    "piecewise_stiffness": lambda gap: {
        "piecewise_stiffness.zone_rad": gap,
        "piecewise_stiffness.soft_ratio": _SOFT,
    },
}
"""Parameters of the laws that are play, or hold it as a special case, by half the gap (rad)."""
_SOFT = 0.02
_TAUT = 0.5  # of the rms torque that is passed on: less may leave the link within the play
_ROUNDS = 6  # of solving with the sign of the torque of the solution before
_ENDS, _SHARES = 0.95, (0.9, 0.6, 0.3)
"""Quantile of the twist that is how far it goes, and shares of that which are tried as play."""
_ORDER, _FEWEST = 3, 5  # of the polynomials that smooth; samples of one


def play(
    evidence: Evidence, parts: Sequence[int], model: Model, effect: str, bare: Model
) -> list[Model]:
    """Return models with play: solved with the stiffness and the motor's inertia, and alone.

    Args:
        evidence: the records, with a twist.
        parts: indices of the fitted parts; other runs are not looked at.
        model: the fit beside which play is looked for.
        effect: one of `PLAYS`.
        bare: of the datasheet, whose spring no fit has bent.

    Returns:
        The one that is solved, unless there is no play or no spring in it, then shares of how far
        the twist goes, with the plant of the fit and that of the datasheet.
    """
    records = evidence.records.records
    runs = sorted({evidence.parts[p].record for p in parts})
    rate = evidence.records.sample_rate_hz
    length = max(int(rate / (evidence.lines * evidence.line_hz)) | 1, _FEWEST)
    columns, twists = [], []
    for record in (records[index] for index in runs):
        assert record.link is not None
        smooth = [
            savgol_filter(signal, length, _ORDER, deriv, 1.0 / rate)
            for signal, deriv in (
                (record.torque, 0), (record.position, 2), (record.position, 1),
                (record.link, 0), (record.link, 1), (record.link - record.position, 0),
            )
        ]  # fmt: skip
        columns.append(np.array(smooth[:5]))
        twists.append(smooth[5])
    torque, acceleration, velocity, link, turning = np.concatenate(columns, axis=1)
    zero = np.repeat(np.eye(len(twists)), [t.size for t in twists], axis=0).T
    twist, direction = np.concatenate(twists), np.sign(velocity)
    nuisance = [*zero, link, turning]
    basis = np.linalg.qr(np.array(nuisance).T)[0]
    goes = float(np.quantile(np.abs(twist - basis @ (basis.T @ twist)), _ENDS))
    tried = [
        Model(plant, {**model.effects, **PLAYS[effect](share * goes)})
        for plant in (model.plant, bare.plant)
        for share in _SHARES
    ]
    passed = torque - model.plant["jm"] * acceleration
    every = np.array([-torque, acceleration, direction, passed, *nuisance])
    for _ in range(_ROUNDS):
        every[3] = -np.sign(passed)
        taut = np.abs(passed) > _TAUT * np.std(passed)
        give, heavy, rubs, gap = np.linalg.lstsq(every[:, taut].T, twist[taut], rcond=None)[0][:4]
        if not (give > 0.0 and heavy > 0.0 and gap > 0.0):
            return tried
        passed = torque - (heavy * acceleration + rubs * direction) / give
    plant = {**model.plant, "k0": 1.0 / float(give), "jm": float(heavy / give)}
    return [Model(plant, {**model.effects, **PLAYS[effect](float(gap))}), *tried]
