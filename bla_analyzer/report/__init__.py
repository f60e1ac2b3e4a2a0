"""The report of an analysis: figures and one HTML page that opens offline."""
