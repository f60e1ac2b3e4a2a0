"""Campaigns: levels and realizations of one experiment, run in batch, kept in a folder of bags.

Begin with `plan.Campaign` (all parameters, checked, and the folder); `settings` reads single
parameters that win over a file, `batch_run` simulates what the folder lacks, `progress` shows how
far it is, `live` the BLA so far (a `chart`), `estimate` what it takes. `example_files` writes what
other rigs would have recorded.
"""
