"""`fjr fit` beside scipy's least squares on the same cost, and beside freq-statespace.

Run `python benchmarks/parametric_fit.py`; with `pip install freq-statespace` (JAX) that runs too.
Known joints are excited by multisines under a held torque, with noise on the position: 7
realizations of 2 periods, drawn anew 5 times. All fit a discrete model of the order of the joint to
the same records. The error is the rms over lines of |model/truth - 1|, and that of the natural
frequencies. python-control fits no frequency responses.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import machine  # noqa: E402

from bla_analyzer.bla.robust import robust_bla  # noqa: E402
from bla_analyzer.fit.likelihood import Task  # noqa: E402
from bla_analyzer.fit.rational import fit_rational  # noqa: E402
from bla_analyzer.fit.sampled import Sampled  # noqa: E402
from bla_analyzer.fit.samples import Samples, samples_of  # noqa: E402
from fjr_records.spectra import PeriodSums  # noqa: E402

RATE, N, REALIZATIONS, PERIODS, DRAWS = 1000.0, 2000, 7, 2, 5
LINES = np.arange(1, 240, 2)
JOINTS = {
    "two masses, order 4": ((0.0, 1.0), (18.0, 0.03)),
    "three masses, order 6": ((0.0, 1.0), (18.0, 0.03), (47.0, 0.02)),
    "five masses, order 10": ((0.0, 1.0), (11.0, 0.03), (18.0, 0.02), (47.0, 0.02), (83.0, 0.01)),
}
"""Natural frequency in Hz and damping of each mode; the first is the rigid body with friction."""

Response = Callable[[np.ndarray], np.ndarray]


def joint(modes) -> tuple[Response, np.ndarray]:
    """Return the sampled response of a sum of modes under a held torque, and its poles in s."""
    poles, residues = [], []
    for f, damping in modes:
        w = 2 * np.pi * f
        pair = np.roots([1.0, 2.0 * damping * w if f else 2.0, w * w])
        poles += [*pair]
        residues += [1 / (pair[0] - pair[1]), 1 / (pair[1] - pair[0])]
    p, r = np.array(poles), np.array(residues)

    def response(f: np.ndarray) -> np.ndarray:
        z = np.exp(2j * np.pi * f / RATE)[:, None]
        small = np.abs(p) < 1e-9
        held = np.where(small, 1 / RATE, np.expm1(p / RATE) / np.where(small, 1.0, p))
        return (r * held / (z - np.exp(p / RATE))).sum(axis=1)

    return response, p


def records(response: Response, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return torque and position, (N, realizations, periods) each."""
    f = LINES * RATE / N
    g = response(f)
    spectrum = np.zeros((REALIZATIONS, N // 2 + 1), complex)
    spectrum[:, LINES] = np.exp(2j * np.pi * rng.random((REALIZATIONS, LINES.size)))
    u = np.fft.irfft(spectrum, N) * N / 2
    spectrum[:, LINES] *= g
    y = np.fft.irfft(spectrum, N) * N / 2
    noise = 3e-2 * np.median(np.abs(g)) * np.sqrt(N) / 10
    y = y[:, None] + noise * rng.standard_normal((REALIZATIONS, PERIODS, N))
    u = np.broadcast_to(u[:, None], y.shape)
    return np.moveaxis(u, 2, 0), np.moveaxis(y, 2, 0)


def bla_samples(u: np.ndarray, y: np.ndarray) -> Samples:
    spectra = []
    for m in range(REALIZATIONS):
        sums = PeriodSums(N)
        for p in range(PERIODS):
            sums.add((u[:, m, p], u[:, m, p], y[:, m, p]))
        spectra.append(sums.spectra(RATE / N, int(LINES[-1])))
    return samples_of(robust_bla(spectra, LINES), 0, "benchmark")


def own(samples: Samples, order: int):
    seen = Sampled.of(samples.frequency_hz, RATE, "z")
    model = fit_rational(Task(samples, seen), order - 1, order)
    return model.response()[0][:, 0], seen.roots(model.lower.roots(model.a))


def with_scipy(samples: Samples, order: int):
    """Fit the coefficients of powers of 1/z by scipy, from iterated linear least squares."""
    delay = np.exp(-2j * np.pi * samples.frequency_hz / RATE)[:, None] ** np.arange(order + 1)
    g, weight = samples.g[:, 0], np.abs(samples.whitening[:, 0, 0])
    below, values = np.ones(g.size, complex), np.zeros(2 * order)
    for _ in range(30):
        matrix = np.concatenate([delay[:, 1:], -g[:, None] * delay[:, 1:]], axis=1)
        scale = (weight / np.abs(below))[:, None]
        rows, right = matrix * scale, g * scale[:, 0]
        values = np.linalg.lstsq(
            np.concatenate([rows.real, rows.imag]),
            np.concatenate([right.real, right.imag]),
            rcond=None,
        )[0]
        below = 1.0 + delay[:, 1:] @ values[order:]

    def model(v: np.ndarray) -> np.ndarray:
        return (delay[:, 1:] @ v[:order]) / (1.0 + delay[:, 1:] @ v[order:])

    def residual(v: np.ndarray) -> np.ndarray:
        error = weight * (model(v) - g)
        return np.concatenate([error.real, error.imag])

    found = least_squares(residual, values, method="lm", x_scale="jac", max_nfev=20_000).x
    return model(found), np.roots([1.0, *found[order:]])


def with_statespace(u: np.ndarray, y: np.ndarray, order: int):
    import freq_statespace as fss

    data = fss.create_data_object(u[:, None], y[:, None], LINES, RATE)
    start = fss.lin.subspace_id(data, order, nq=2 * order + 2, logging_enabled=False)
    model = fss.lin.optimize(start, data, print_every=-1)
    a, b, c, d = (np.asarray(m) for m in (model.A, model.B_u, model.C_y, model.D_yu))
    z = np.exp(2j * np.pi * LINES / N)
    g = np.array([(c @ np.linalg.solve(at * np.eye(order) - a, b) + d)[0, 0] for at in z])
    return g * float(data.norm.y_std[0] / data.norm.u_std[0]), np.linalg.eigvals(a)


def errors(g: np.ndarray, poles: np.ndarray, truth: np.ndarray, true_poles: np.ndarray):
    """Return rms relative error of g, and of the natural frequencies of the modes."""
    with np.errstate(divide="ignore"):
        found = np.log(poles.astype(complex)) * RATE
    modes = true_poles[true_poles.imag > 1.0]
    off = np.array([np.abs(np.abs(found) - abs(p)).min() / abs(p) for p in modes])
    relative = np.abs(g / truth - 1.0)
    return float(np.sqrt(np.mean(relative**2))), float(np.sqrt(np.mean(off**2)))


def main() -> None:
    print(machine.describe() + "\n")
    print(f"{'':24}{'':18}{'seconds':>10}{'error of G':>12}{'of modes':>10}{'cost':>10}")
    for name, modes in JOINTS.items():
        response, true_poles = joint(modes)
        truth, order = response(LINES * RATE / N), 2 * len(modes)
        rng = np.random.default_rng(1)
        drawn = [records(response, rng) for _ in range(DRAWS)]
        samples = [bla_samples(u, y) for u, y in drawn]
        methods = {
            "fjr fit": lambda i, s=samples, n=order: own(s[i], n),
            "scipy": lambda i, s=samples, n=order: with_scipy(s[i], n),
        }
        if statespace_is_there():
            methods["freq-statespace"] = lambda i, d=drawn, n=order: with_statespace(*d[i], n)
        for method, fit in methods.items():
            rows = []
            for i in range(DRAWS):
                begun = time.perf_counter()
                g, poles = fit(i)
                seconds = time.perf_counter() - begun
                rest = samples[i].whitened(samples[i].g - g[:, None])
                cost = float((np.abs(rest) ** 2).sum())
                rows.append((seconds, *errors(g, poles, truth, true_poles), cost))
            seconds, error, mode, cost = np.median(rows, axis=0)
            print(f"{name:24}{method:18}{seconds:10.3f}{error:12.2e}{mode:10.1e}{cost:10.4g}")
    print(f"\nThe cost that is expected of a true model is {LINES.size} less half its parameters.")


def statespace_is_there() -> bool:
    try:
        import freq_statespace  # noqa: F401
    except ImportError:
        return False
    return True


if __name__ == "__main__":
    main()
