"""Estimators of the BLA: robust, fast, local polynomial."""
