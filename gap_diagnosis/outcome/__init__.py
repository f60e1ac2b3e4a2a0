"""The outcome of a diagnosis: its schema, and verdicts in plain words."""
