"""The result of an analysis: its types with units, its tables, and its words.

Begin with `result`, from which all outputs are made: `tables` for other tools (CSV, NPZ, MAT,
python-control), `summary` for what a person reads first, `findings` for what the data of each level
say and cannot say. `loop` tells the sensitivity peak, `terms` what the words mean.
"""
