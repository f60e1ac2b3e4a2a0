"""What a user knows of a controller, read from a file and turned into a description.

The file is YAML or JSON. Its `kind` names the structure; every gain is a number, or `unknown`:

    kind: pid                       p, i, d; n (derivative filter, rad/s), derivative_on: error or
                                    measurement, setpoint_weight; pd is the same without i
    kind: p_pi                      k_position (1/s), k_velocity (N m s/rad), integral_time_s,
                                    velocity_filter_rad_s: P position loop around a PI velocity loop
    kind: transfer_function         numerator, denominator, from r - y to u
    kind: two_degrees_of_freedom    reference and position with numerator and denominator each,
                                    u = C_r r - C_y y
    kind: pd_filtered               p, d, n: the law of the controller node

Any kind may have `rate_hz`, the rate at which the law runs where its record is sampled more slowly;
`between_samples` then says whether a sample of the reference is `held` until the next (a command
that is logged when it is sent) or both are `joined` by a straight line.

Transfer functions are `domain: discrete` (powers z^0, z^-1, ...) or `continuous` (descending powers
of s, made discrete by Tustin's rule); of their coefficients those of a numerator may be unknown.
Integrals are sums, (Ts/(1 - z^-1)); a derivative is a difference, (1 - z^-1)/Ts, with the low-pass
(1 - a)/(1 - a z^-1), a = exp(-n Ts), where it has a filter; that of `pd_filtered` alone is the
step-invariant one. Any kind may have `torque_limit_nm`, and `feed_forward` with
`velocity` (N m s/rad) and `acceleration` (N m s^2/rad). The torque is clamped to its limit, an
integral is not: there is no anti-windup.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fjr_interface.bags.plain_yaml import load_plain_yaml
from fjr_interface.bounded_yaml import YamlProblem
from fjr_kit.errors import InputError

from .structures import (
    ONE_DEGREE,
    TWO_DEGREES,
    UNKNOWN,
    AnyStructure,
    FeedForward,
    NodeLaw,
    structure_of,
    unknown_names,
)

_LARGEST_FILE = 2**20


def read_controller(path: Path) -> AnyStructure:
    """Read the file; raise InputError that names the field."""
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise InputError(f"{path}: is larger than {_LARGEST_FILE} bytes; name another file.")
        content = load_plain_yaml(path.read_bytes().decode())
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except YamlProblem as problem:
        place = "" if problem.line is None else f"line {problem.line}: "
        raise InputError(f"{path}: {place}{problem}.") from None
    except (ValueError, RecursionError):
        raise InputError(f"{path}: is neither YAML nor JSON; write the controller anew.") from None
    return structure_of(content, f"{path}: controller")


def describe(structure: AnyStructure, sample_rate_hz: float, source: str) -> dict[str, Any]:
    """Return the `controller` entry of an experiment description.

    A structure whose gains are all known becomes `pd_filtered`, `transfer_function` or
    `two_degrees_of_freedom` with one denominator, discrete at this rate; `given` beside it is what
    the user gave. Otherwise it stays what it is: unknown gains are null, and listed in `unknown`,
    so that `law.law_of` makes the law once they have values.

    Raises:
        InputError: the law is not causal or not stable; names `source`.
    """
    given = structure.model_dump(exclude_defaults=True)
    unknown = unknown_names(given)
    if unknown:
        return {**_nulled(given), "unknown": unknown}
    law = structure.law(sample_rate_hz, f"{source}: controller")
    limit = structure.torque_limit_nm
    clamp = {"torque_limit_nm": None if limit is None else float(limit)}
    if isinstance(structure, NodeLaw) and not _more(structure):
        gains = {"p": structure.p, "d": structure.d, "n": structure.n}
        return {"kind": structure.kind, **gains, **clamp}
    reference, position, denominator = (
        part.tolist() for part in (law.reference, law.position, law.denominator)
    )
    if law.one_degree:
        one = {"numerator": position, "denominator": denominator}
        return {"kind": ONE_DEGREE, **one, **clamp, "given": given}
    return {
        "kind": TWO_DEGREES,
        "reference": {"numerator": reference, "denominator": denominator},
        "position": {"numerator": position, "denominator": denominator},
        **clamp,
        "given": given,
    }


def _more(structure: NodeLaw) -> bool:
    """Tell whether a law of the controller node has what the node itself has not."""
    return structure.feed_forward != FeedForward() or structure.rate_hz is not None


def _nulled(given: Any) -> Any:
    if isinstance(given, dict):
        return {key: _nulled(value) for key, value in given.items()}
    if isinstance(given, list):
        return [_nulled(value) for value in given]
    return None if given == UNKNOWN else given
