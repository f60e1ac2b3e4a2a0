"""Rehearsal on the wall clock: timing, faults, limits, GO or NO-GO: `fjr rehearse`."""
