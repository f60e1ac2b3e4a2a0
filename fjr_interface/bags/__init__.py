"""Bags of the interface: written, read in blocks, audited sample by sample.

Begin with `reader.BagReader` (samples as arrays, in bounded memory; `signals` says which topics
they are, `audit` that none is missing, `signal_queues` pairs their samples) and `writer.BagWriter`,
whose `storage` writes MCAP; `folder_names` are those of the bags. `topic_survey` says what any
topic of any bag is like.

Below them `files` finds the storage by the `metadata` of the bag, which `plain_yaml` reads; `qos`
is that of a topic. `mcap_blocks` (with `mcap_index`, `mcap_messages` and `mcap_summary`) and
`sqlite` read the storage as `blocks` and trust nothing; `definitions` and `joint_state` decode
messages.
"""
