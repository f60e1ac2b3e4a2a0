"""A `Result` made in the frequency domain: two-mass G0, known distortion, known noise."""

from __future__ import annotations

import numpy as np
from scipy.stats import f as f_distribution

from bla_analyzer.bla.sensitivity import sensitivity as sensitivity_of
from bla_analyzer.results.result import (
    BlaEstimate,
    Comparison,
    LevelResult,
    LineLevels,
    Result,
)
from fjr_kit.check import Check
from fjr_records.realization import TimeSignals

RATE, PERIOD, M, P = 1000.0, 10_000, 7, 2


def two_mass(frequency_hz: np.ndarray, link_damping=4.0, motor_damping=2.0) -> np.ndarray:
    """G0 of paper.md: motor torque -> motor position, rad/(N m)."""
    s = 2j * np.pi * frequency_hz
    link = 0.3 * s**2 + link_damping * s + 1500.0
    motor = 0.2 * s**2 + motor_damping * s + 1500.0
    return link / (link * motor - 1500.0**2)


def _controller(frequency_hz: np.ndarray) -> np.ndarray:
    s = 2j * np.pi * frequency_hz
    return 200.0 + 60.0 * s / (1.0 + s / 24.0)


def _grid(generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    odd = np.arange(1, 501, 2)[:249].reshape(-1, 3)
    left_out = generator.integers(0, 3, len(odd))
    detection = odd[np.arange(len(odd)), left_out]
    excited = np.setdiff1d(odd, detection)
    return excited * 0.1, detection * 0.1, np.arange(2, 501, 2) * 0.1


def _complex_noise(generator, shape, sigma):
    pair = generator.standard_normal((2, *shape)) * sigma / np.sqrt(2.0)
    return pair[0] + 1j * pair[1]


def _estimate(frequency, u, y, periods) -> BlaEstimate:
    """Robust method on reference-phased spectra of shape (M, P, F)."""
    um, ym = u.mean(1), y.mean(1)
    big_u, big_y = um.mean(0), ym.mean(0)
    g = big_y / big_u
    m = len(u)
    total = (abs(ym - g * um) ** 2).sum(0) / (m * (m - 1) * abs(big_u) ** 2)
    noise = np.full_like(total, np.nan)
    p_value = np.full_like(total, np.nan)
    if periods > 1:
        residual = (y - ym[:, None]) - g * (u - um[:, None])
        noise = (abs(residual) ** 2).sum((0, 1)) / (
            m**2 * periods * (periods - 1) * abs(big_u) ** 2
        )
        p_value = f_distribution.sf(total / noise, 2 * (m - 1), 2 * m * (periods - 1))
    relative = (abs(um - big_u) ** 2).sum(0) / (m * (m - 1)) / abs(big_u) ** 2
    return BlaEstimate(
        method="robust",
        realizations=m,
        periods=periods,
        frequency_hz=frequency,
        g=g,
        var_total=total,
        var_noise=noise,
        var_nonlinear=m * (total - noise),
        nonlinear_p_value=p_value,
        radius_95=np.sqrt(total * f_distribution.ppf(0.95, 2, 2 * (m - 1))),
        coherence=abs(g) ** 2 / (abs(g) ** 2 + m * total),
        input_relative_variance=relative,
        reliable=relative < 0.01,
    )


def _rolloff(frequency_hz: np.ndarray) -> np.ndarray:
    """Shape of the distortion at the output: friction matters less at high frequency."""
    return 1.0 / (1.0 + (frequency_hz / 5.0) ** 2)


def _lines(frequency, reference, distortion, noise, generator) -> LineLevels:
    k = len(frequency)
    corrected = abs(
        _complex_noise(generator, (M, k), distortion) + _complex_noise(generator, (M, k), noise)
    )
    corrected = np.sqrt((corrected**2).mean(0))
    window = np.ones(9)
    weight = np.convolve(np.ones(k), window, "same")
    sensitivity = 1.0 / (1.0 + _controller(frequency) * two_mass(frequency))
    position = corrected * abs(sensitivity)
    return LineLevels(
        frequency_hz=frequency,
        reference=np.full(k, reference),
        torque=position * abs(_controller(frequency)),
        position=position,
        corrected=corrected,
        smoothed=np.sqrt(np.convolve(corrected**2, window, "same") / weight),
        noise=np.full(k, noise),
    )


def _v(g, g0, keep):
    error = (20 * np.log10(abs(g0)) - 20 * np.log10(abs(g)))[keep] ** 2
    return float(error.mean()), float(np.median(error))


def _comparison(name, description, bla, g0) -> Comparison:
    mean, median = _v(bla.g, g0, np.ones(len(g0), bool))
    mean_above, median_above = _v(bla.g, g0, bla.frequency_hz >= 1.0)
    return Comparison(
        name=name,
        description=description,
        g0=g0,
        v_mean=mean,
        v_median=median,
        v_mean_above_1hz=mean_above,
        v_median_above_1hz=median_above,
    )


def make_level(level=0, amplitude=7e-3, periods=P, seed=1) -> LevelResult:
    """One level whose odd distortion and noise scale as a real rig's would."""
    generator = np.random.default_rng([seed, level])
    frequency, odd_hz, even_hz = _grid(generator)
    g0, c = two_mass(frequency), _controller(frequency)
    truth = g0 * (1.0 + 0.15 * np.exp(-frequency / 3.0))
    sensitivity = 1.0 / (1.0 + c * truth)
    noise, distortion = 2e-5, 6e-4 * np.sqrt(amplitude / 7e-3)
    d = _complex_noise(generator, (M, 1, len(frequency)), distortion * _rolloff(frequency))
    v = _complex_noise(generator, (M, periods, len(frequency)), noise)
    y = sensitivity * (truth * c * amplitude + d + v)
    u = c * (amplitude - y)
    bla = _estimate(frequency, u, y, periods)
    turned_u, played = u.mean(axis=(0, 1)), np.full(frequency.shape, amplitude)
    found = sensitivity_of(bla.g, bla.radius_95, turned_u, played)
    bla = bla.model_copy(update={"sensitivity": found})
    time = np.arange(PERIOD) / RATE
    phase = generator.uniform(0, 2 * np.pi, len(frequency))
    turned = np.exp(1j * phase)
    spectra = {"reference_rad": amplitude * turned, "torque_nm": u[0, -1] * turned}
    spectra["position_rad"] = y[0, -1] * turned
    signals = {name: _synthesize(frequency, x) for name, x in spectra.items()}
    excited = LineLevels(
        frequency_hz=frequency,
        reference=np.full(len(frequency), amplitude),
        torque=np.sqrt((abs(u.mean(1)) ** 2).mean(0)),
        position=np.sqrt((abs(y.mean(1)) ** 2).mean(0)),
        corrected=np.sqrt((abs(y.mean(1)) ** 2).mean(0)),
        smoothed=np.sqrt((abs(y.mean(1)) ** 2).mean(0)),
        noise=np.full(len(frequency), noise / np.sqrt(periods) if periods > 1 else np.nan),
    )
    rms = {name: float(np.sqrt((x**2).mean())) for name, x in signals.items()}
    noise_p = noise / np.sqrt(periods) if periods > 1 else np.nan
    return LevelResult(
        level=level,
        amplitude_rad=np.full(len(frequency), amplitude),
        bla=bla,
        excited=excited,
        odd=_lines(odd_hz, 0.0, distortion * _rolloff(odd_hz), noise_p, generator),
        even=_lines(even_hz, 0.0, 0.0, noise_p, generator),
        left_out_hz=np.empty(0),
        comparisons=(
            _comparison("G0_viscous", "ZOH equivalent, viscous friction", bla, g0),
            _comparison("G0_paper", "as printed in eqs. 6-7", bla, two_mass(frequency, 9.0, 8.0)),
        ),
        signals=TimeSignals(time_s=time, **signals),
        reference_rms_rad=rms["reference_rad"],
        torque_rms_nm=rms["torque_nm"],
        position_rms_rad=rms["position_rad"],
        torque_peak_nm=float(abs(signals["torque_nm"]).max()),
        position_peak_rad=float(abs(signals["position_rad"]).max()),
    )


def _synthesize(frequency, spectrum):
    full = np.zeros(PERIOD // 2 + 1, complex)
    full[np.rint(frequency * PERIOD / RATE).astype(int)] = spectrum
    return np.fft.irfft(full, PERIOD) * PERIOD / 2.0


def make_result(amplitudes=(1e-3, 7e-3, 3e-2), periods=P, checks=None, **changes) -> Result:
    """A whole result, one level for each amplitude."""
    levels = tuple(make_level(i, a, periods) for i, a in enumerate(amplitudes))
    values = {
        "source": "campaigns/two_mass",
        "excitation": "periodic",
        "sample_rate_hz": RATE,
        "samples_per_period": PERIOD,
        "periods": periods,
        "transient_periods": 1,
        "described": True,
        "bags": tuple(f"level_{i}_realization_{m}" for i in range(len(levels)) for m in range(M)),
        "levels": levels,
        "checks": _checks(len(levels)) if checks is None else checks,
        "notes": ("The first period of each bag was discarded as transient.",),
        "controller": {"kind": "pd_filtered", "p": 200.0, "d": 60.0, "n": 24.0},
    }
    return Result(**(values | changes))


def _checks(levels: int) -> tuple[Check, ...]:
    checks = [
        Check(
            name="periodicity",
            level=level,
            realization=m,
            passed=True,
            value=1e-4 * (1 + m),
            limit=1e-2,
            sentence=f"level {level}, realization {m}: periods differ by {1e-4 * (1 + m):.1e}.",
        )
        for level in range(levels)
        for m in range(M)
    ]
    failed = Check(
        name="input_snr",
        level=0,
        passed=False,
        value=0.04,
        limit=0.01,
        sentence="level 0: Var(U)/|U|^2 reaches 0.04 at 3 lines; those lines are flagged.",
    )
    return (*checks, failed)
