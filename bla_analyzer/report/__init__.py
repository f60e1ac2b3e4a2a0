"""The report of an analysis: one HTML page that opens offline, and figures for papers.

A `results.result.Result` goes in. `report_page` fills the template report.html, with plots of
`report_plots`; `figures` draws one set for each level, `figures_overview` all levels together.
"""
