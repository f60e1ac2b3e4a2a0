"""What every package needs and no rig knows of.

`errors.InputError` is the one exception that a user is meant to read. Files and folders are
written as a whole or not at all (`atomic`), a folder by one command at a time (`folder_lock`).
Work that takes long tells how far it is (`telling`), which is shown (`progress`), stops at a signal
where that leaves nothing behind (`stopping`), is spread over cores or a Dask cluster (`tasks`,
`worker_pool`) and lies in processes that end with their parent (`processes`).

Results are types with units, written as JSON and read back (`result_types`); a tested condition is
a `check`. Reports are pages that open offline (`page`), with plots as plain dicts (`plots`) or
figures (`figure_style`), numbers as `number_text`, and say how they were made (`invocation`).
Tables go to a `terminal` or, where the code is what they describe, into a document
(`document_tables`). A command outlives the reader of its output (`output_pipe`).

`compiled` caches the numerical kernels by the state of their sources, each compiled once, `imports`
finds the sources that a kept result rests on, `installed` where packages and extras are.
`public_names` imports what a package exports when it is asked for. `least_squares` fits with
Jacobians of one batch. `showing` says what a refit of
parameters leaves of a change, and how large a change must be to show. Nothing here imports another
package of the product.
"""
