"""Which effects cause the gap: fits, screening, attribution, confidence."""
