"""Writes the files of a fit into a folder, all of them or none."""

from __future__ import annotations

from pathlib import Path

from fjr_interface.parameter_file import save_parameter_file
from fjr_kit.atomic import result_folder
from fjr_kit.telling import Progress
from fjr_sim_node.plant import PLANT

from ..results.tables import mat_file, matlab_struct
from .fit_types import Fit
from .nominal_values import nominal_values

OWN_FILES = (
    "fit.html",
    "fit.json",
    "fit.mat",
    "nominal_level_*.yaml",
    "figures/level_*_fit.p[nd][gf]",
)
"""What an earlier fit may have left in a folder, as patterns."""


def write_fit(
    fit: Fit,
    out: Path | str,
    *,
    report: bool = True,
    progress: Progress | None = None,
    provenance: dict[str, str] | None = None,
) -> Path:
    """Write fit.json, fit.mat, of physical models nominal_level_N.yaml, figures/ and fit.html.

    Everything is written to a temporary folder first and moved when whole; files of an earlier fit
    are replaced, other files in `out` stay.

    Args:
        fit: the models.
        out: the folder; made if it is absent.
        report: whether to write fit.html and figures.
        progress: called with what is being written.
        provenance: what made the page, by name, in order.

    Returns:
        The path of fit.html (of fit.json without a report).

    Raises:
        InputError: `out` cannot be written.
    """
    say = progress or (lambda _: None)
    with result_folder(Path(out), OWN_FILES) as folder:
        say("fit.json")
        (folder / "fit.json").write_text(fit.to_json(), encoding="utf-8")
        (folder / "fit.mat").write_bytes(mat_file({"fit": matlab_struct(fit)}, "fjr_rig/fit/1"))
        for level in fit.levels if fit.model != "rational" else ():
            save_parameter_file(
                folder / f"nominal_level_{level.level}.yaml",
                {"simulator": nominal_values(level)},
                {"simulator": PLANT},
            )
        if report:
            from .fit_figures import write_fit_figures
            from .fit_page import render_fit

            (folder / "figures").mkdir()
            write_fit_figures(fit, folder / "figures", say)
            say("fit.html")
            (folder / "fit.html").write_text(render_fit(fit, provenance or {}), encoding="utf-8")
    return Path(out) / ("fit.html" if report else "fit.json")
