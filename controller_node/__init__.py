"""Controller: the filtered PD law, and the node that runs it."""
