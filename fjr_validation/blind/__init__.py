"""The blind check: cases from a second plant, sealed answers, committed verdicts, scores."""
