"""The report of an analysis: one HTML page that opens offline, and figures for papers.

A `results.result.Result` goes in. `report_page` fills the template report.html, with interactive
plots of a level (`report_plots`, `loop_plots`) and of all levels (`overview_plots`). Figures for
papers are in `figures` and `figures_loop` for each level, in `figures_overview` for all together.
"""
