"""The places of the report's plots, with their captions."""

from __future__ import annotations

from .page import figure

OVERVIEW = (
    figure("all-bla", 380, "<b>BLA of all levels.</b> Click on a curve to choose its level below.")
    + '<div class="pair">\n'
    + figure("all-v", 340, "<b>Distance V from the models</b> against amplitude.")
    + figure("all-power", 340, "<b>Mean power of the position</b> against amplitude.")
    + "</div>\n"
)

FIGURES = (
    figure(
        "bla",
        640,
        "<b>BLA</b> and its uncertainty, beside the models. The nonlinear standard deviation is "
        "that of one realization; it is drawn only where it is significant (F-test, p &lt; 0.05), "
        "so a gap means that noise alone explains the spread there. Hollow points are unreliable.",
    )
    + figure(
        "spectra",
        680,
        "<b>Spectra</b> of reference, torque and position, peak amplitude of a line, rms over "
        "realizations. Energy at odd detection lines shows odd nonlinearity, at even lines even "
        "nonlinearity (in closed loop the torque carries both). Lines of the reference that are "
        "mere round-off are left out.",
    )
    + figure(
        "distortion",
        420,
        "<b>Distortion at the output</b>, corrected for the loop: Yc = Y \N{MINUS SIGN} G U at "
        "lines that are not excited. Points are single lines, curves the mean power of neighbours.",
    )
    + figure("time", 480, "<b>Last period</b> of the first realization.")
)
