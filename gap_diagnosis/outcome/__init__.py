"""The outcome of a diagnosis: its schema, and its words.

`diagnosis` holds the types of diagnosis.json with units, as everything else of this package takes
them; `cause`, `gap_size` and `contender` are the smaller ones. `verdict_words` says what a verdict
means and when not to believe it, `cause_words` puts causes, remainder and evidence into sentences,
`linear_words` those of a linear axis into its units. Terminal and report use the same.
"""
