"""The `fjr` command: one module for each command, with its options and what it prints.

Begin with `app`, which lists them all. What a command computes is in the package that it belongs
to. Commands import what they need when they are called, so that `fjr --help` is quick, and go
through `cli_errors`, so that no traceback reaches a user.

- Commands, in modules of their names: `run`, `simulate`, `demo`, `example`, `rehearse`,
  `amplitude`, `shape`, `plan`, `paper`, `analyze`, `fit`, `diagnose`, `export`, `compare`,
  `bridge`, `replay`, `record`, `check`, and `blind` with two commands below it. Two modules have
  other names: `import_records` is the import, and `by_hand` holds the eight commands of running
  nodes, from pause to emergency stop.
- Options that several commands have: `campaign_options`, `described_runs`, `graph_options`,
  `record_options`, `result_options`, `search_options`, `worker_options`; `option_groups` unfolds a
  dataclass of options.
- What commands print: `analysis_summary`, `check_summary`, `compare_summary`, `diagnosis_summary`,
  `fit_summary`, `import_summary`, `plan_summary`, `replay_summary`, and `stage_progress` while they
  work.
- `campaign_folder` puts the bags of a campaign into their folder, `schemas` writes the JSON Schemas
  of all JSON files.
"""
