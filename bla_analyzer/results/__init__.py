"""The result of an analysis: its types with units, its tables, and its summary in words."""
