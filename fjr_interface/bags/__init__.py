"""Bags of the interface: written, read in blocks, audited sample by sample."""
