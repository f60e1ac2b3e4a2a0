"""Fig. 9: its three BLAs against both versions of G0 and by their resonances."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fjr_kit.tasks import Arrays

from .fig4 import sweep
from .fig7_to_9_drawing import FIG9
from .levels import variant
from .part import Statement, Table, repeats
from .prediction import difference
from .resonance import fit_level
from .settings import ALMOST_DB2, SMALL_RAD, Settings
from .two_inertia import Resonances

RMS_READING = float(np.sqrt(2.0))
"""Peak over rms of a line: the paper does not say of which its 1 mrad speaks."""
REFERENCES = ("viscous", "paper")


def statements(
    results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float
) -> tuple[Statement, ...]:
    """Return what Fig. 9 says beside what its three experiments measured."""
    repeat = "fjr paper; fjr simulate and fjr analyze"
    friction, by_rms = results["fig9_friction_noise"], results["fig9_friction_rms_noise"]
    strong, both = results["fig9_transmission_noise"], results["fig9_both_noise"]
    almost = min(friction["v"][variant(model)] for model in REFERENCES) < ALMOST_DB2
    swept = sweep(results, settings, "transmission")
    highest = int(np.flatnonzero(swept.periodic == 1.0)[-1])
    clean, shifted = fit_level(swept.levels[highest]), fit_level(strong)
    v_both = [both["v"][c] for c in (variant(band="all"), variant(), variant(statistic="median"))]
    return (
        Statement(
            "Fig. 9",
            "friction only (M 40, P 4): the BLA is almost the linearized model",
            "V from 1 Hz, mean (median): against G0 with viscous friction "
            f"{_mean_and_median(friction, 'viscous')}, against eqs. 6-7 (dry friction added) "
            f"{_mean_and_median(friction, 'paper')} dB²; with 1 mrad read as the rms of a line "
            f"{_mean_and_median(by_rms, 'viscous')} and {_mean_and_median(by_rms, 'paper')}",
            repeats(bool(almost)),
            repeat,
        ),
        Statement(
            "Fig. 9",
            "transmission only (M 100): resonances shifted to the right",
            f"antiresonance 11.25 to {_hz(clean, 'antiresonance')}, resonance 17.79 to "
            f"{_hz(clean, 'resonance')} at {1e3 * swept.amplitudes[highest]:.0f} mrad, the highest "
            "amplitude with a periodic response in every realization; at the paper's 90 mrad "
            f"{_hz(shifted, 'antiresonance')} and {_hz(shifted, 'resonance')}, a mean of responses "
            f"of which {_periodic_share(results, 'transmission')} are periodic",
            repeats(clean.resonance_hz - clean.resonance_half_hz > 17.79),
            repeat,
        ),
        Statement(
            "Fig. 9",
            "both at the optimum amplitude: the BLA fits G0 perfectly",
            f"V against G0 with viscous friction {v_both[0]:.2f} dB² with all lines, "
            f"{v_both[1]:.2f} from 1 Hz, median {v_both[2]:.3f}, at {1e3 * amplitude_rad:.2g} mrad "
            f"with noise; against eqs. 6-7 {_mean_and_median(both, 'paper')}",
            repeats(bool(v_both[1] < 1.0)),
            repeat,
        ),
    )


def _mean_and_median(result: Arrays, model: str) -> str:
    mean, median = (result["v"][variant(model, statistic)] for statistic in ("mean", "median"))
    return f"{mean:.3g} ({median:.2g})"


def _hz(found: Resonances, kind: str) -> str:
    value, half = getattr(found, f"{kind}_hz"), getattr(found, f"{kind}_half_hz")
    return f"{value:.2f} \N{PLUS-MINUS SIGN} {half:.2f} Hz"


def mean_of_responses(results: Mapping[str, Arrays]) -> str:
    """Say what the curves are for which not every realization is periodic."""
    return " ".join(
        f"Of the realizations of {name}, {_periodic_share(results, name)} are periodic, so its "
        "curve is that of a mean of responses, no BLA."
        for name, _ in FIG9
        if float(results[f"fig9_{name}_noise"]["periodic"]) < 1.0
    )


def _periodic_share(results: Mapping[str, Arrays], name: str) -> str:
    with_noise, without = (
        100.0 * float(results[f"fig9_{name}{noise}"]["periodic"]) for noise in ("_noise", "")
    )
    return f"{with_noise:.0f} % with noise and {without:.0f} % without"


def references_table(results: Mapping[str, Arrays]) -> Table:
    """Return V against both versions of G0."""
    rows = []
    for name, words in (
        ("friction", "friction, 1 mrad"),
        ("friction_rms", f"friction, {1e3 * RMS_READING * SMALL_RAD:.2f} mrad (1 mrad as rms)"),
        ("transmission", "transmission, 90 mrad"),
        ("both", "both, at the optimum"),
    ):
        for noise, noise_words in (("_noise", "20 dB SNR"), ("", "none")):
            result = results[f"fig9_{name}{noise}"]
            v = (_mean_and_median(result, model) for model in REFERENCES)
            rows.append((words, noise_words, *v))
    return Table(
        "Fig. 9: V from 1 Hz on, mean (median) over lines in dB², against both versions of G0.",
        ("case", "noise", "viscous friction only", "eqs. 6-7: dry friction added"),
        tuple(rows),
    )


def over_noise_db(result: Arrays) -> float:
    """Return the median of distortion over noise variance of one realization (dB)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = result["var_nonlinear"] / result["var_noise"]
    positive = ratio[np.isfinite(ratio) & (ratio > 0)]
    return float(10.0 * np.log10(np.median(positive))) if positive.size else float("nan")


def table(results: Mapping[str, Arrays]) -> Table:
    """Return distances, resonances, distortion and noise of the BLAs."""
    rows = []
    for name, _ in FIG9:
        for noise, words in (("_noise", "20 dB SNR"), ("", "none")):
            result = results[f"fig9_{name}{noise}"]
            found = fit_level(result)
            v = [f"{result['v'][variant('viscous', 'mean', band)]:.3g}" for band in ("all", "1hz")]
            rows.append(
                (
                    name,
                    words,
                    *v,
                    f"{found.antiresonance_hz:.2f} \N{PLUS-MINUS SIGN} "
                    f"{found.antiresonance_half_hz:.2f}",
                    f"{found.resonance_hz:.2f} \N{PLUS-MINUS SIGN} {found.resonance_half_hz:.2f}",
                    "{:.3g} / {:.2g}".format(*difference(result)[:2]),
                    f"{over_noise_db(result):.0f}",
                    f"{100 * float(result['periodic']):.0f} %",
                )
            )
    return Table(
        "The BLAs of Fig. 9. Noise: median of the nonlinear variance of one realization over the "
        "noise variance of the BLA. From prediction: distance to the BLA of statistical "
        "linearisation from 1 Hz on, in dB\N{SUPERSCRIPT TWO} and in sigma (0.7: exact).",
        ("case", "noise", "V all", "V from 1 Hz", "antiresonance (Hz)", "resonance (Hz)",
         "from prediction", "over noise (dB)", "periodic"),
        tuple(rows),
    )  # fmt: skip
