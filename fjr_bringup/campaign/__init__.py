"""Campaigns: levels and realizations of one experiment, run in batch, kept in a folder of bags."""
