"""What the words of an analysis mean: said here once, for the report and for docs/glossary.md.

`python -m bla_analyzer.results.terms docs/glossary.md` renews that document.
"""

from __future__ import annotations

from fjr_kit.document_tables import renew

TERMS = {
    "BLA": (
        "Best Linear Approximation: the linear response from motor torque to motor position "
        "that leaves the least mean squared error for one class of excitation. It changes with "
        "amplitude, since the joint is nonlinear."
    ),
    "G0": "The response of the rig's linear part: linear stiffness and viscous friction only.",
    "V": (
        "Mean squared distance of the BLA from G0 over the lines, both in dB; in dB² (the "
        "paper's eq. 14). A few lines below 1 Hz can dominate it."
    ),
    "M": (
        "Number of realizations of a level: draws of the multisine's random phases, each played"
        " and recorded once. Nonlinear variance falls as 1/M."
    ),
    "P": (
        "Number of periods kept of each realization after the transient; their scatter is "
        "noise. Noise falls as 1/(M P)."
    ),
    "Disc": (
        "The circle around an estimate of G, in the complex plane, that holds the true value "
        "with a probability of 95 %."
    ),
    "Band": (
        "What a disc spans in magnitude or in phase: the area from the least to the greatest "
        "value within it."
    ),
    "Coherence": (
        "Share of the power of the position in one realization that G U explains, from 0 to 1; "
        "the rest is distortion and noise."
    ),
    "S": (
        "Sensitivity of the loop, 1/(1 + G C): the response from reference to error. "
        "Disturbances of the position are damped where |S| is below 1, and amplified where it "
        "is above."
    ),
    "Ms": (
        "Peak of |S| over the excited lines. 1/Ms is the least distance of the loop G C from "
        "the point \N{MINUS SIGN}1; values of 1.3 to 2 are usual."
    ),
}
"""What a word or a letter means, in plain sentences."""


def glossary() -> str:
    """Return the terms as paragraphs of the glossary."""
    return "\n\n".join(f"**{name}.** {text}" for name, text in TERMS.items())


if __name__ == "__main__":
    renew({"terms of an analysis": glossary()})
