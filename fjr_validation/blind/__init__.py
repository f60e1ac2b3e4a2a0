"""The blind check: random rigs of a second plant, sealed answers, raw verdicts, scores.

Begin with `check`, which runs one.

- A case is made by `worlds`: `rigs` draws plant and controller, `excitations` what is played on
  them, `stage` friction, noise and datasheet, `causes` and `remainders` what the datasheet does not
  say (each by `draw`), `visibility` how large to make it. `making` does so in a process of its own,
  `open_cases` with open answers, for development.
- The second plant: `second_plant`, its laws in `second_laws`, compiled by `second_compiled`;
  `second_simulation` plays it in its loop.
- A check: `lanes` work side by side, `answers` are the truth of a case, `seal` encrypts them,
  `json_lines` keeps the verdicts, `check_cost` says beforehand what it takes, `frozen` names by a
  hash what may not change while it runs.
- The methods that are compared: `methods` lists and applies them. `baselines`, `bam` (on
  `bam_plant`), `pace` and `mujoco_sysid` are those beside the diagnosis; `baseline_fit` and
  `cma_fit` are their fits.
- Scores and report: `claims` reads what a verdict names, `outcome` judges one, `score` all of them;
  `report` writes them up in the words of `report_text`, with `figures`, the table of methods in
  `rivals`, and the other `check_documents`.
"""
