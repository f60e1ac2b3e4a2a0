"""Validation: the paper's experiments run again, and the blind check of the diagnosis.

Begin with `paper.reproduction` (each of the paper's statements beside what was measured) and
`blind.check` (cases of a second plant, sealed answers, verdicts, scores).
"""
