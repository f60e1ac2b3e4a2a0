"""Bags of the interface: written, read in blocks, audited sample by sample.

Begin with `reader.BagReader` (samples as arrays, in bounded memory; `signals` says which topics
they are, `audit` that none is missing) and `writer.BagWriter`. Below them `files` finds the
storage, `mcap_blocks` and `sqlite` read it and trust nothing, `definitions` and `joint_state`
decode messages.
"""
