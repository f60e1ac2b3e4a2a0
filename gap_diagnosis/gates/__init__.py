"""Is the record fit for a diagnosis? Quality, controller identity, stationarity."""
