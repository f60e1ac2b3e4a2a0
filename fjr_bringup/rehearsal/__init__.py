"""Rehearsal on the wall clock, with faults, that ends in GO or NO-GO: `fjr rehearse`.

A checked `request` goes in, a `result.Rehearsal` and its `report` come out. Begin with `rehearse`,
which leads through it: `rehearsal_run` conducts the nodes, `loop_progress` shows how far it is,
`observer` writes down every message, `timing`, `safety`, `prediction` and `machine` say what came
of it, `limits` judge, `advice` tells what to do. `tables` writes limits and faults into the
documents.
"""
