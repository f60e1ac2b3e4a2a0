"""A BLA beside reference models.

`metrics` is the distance V (paper eq. 14), `reference_models` the linear models of the nominal rig,
`optimum` finds the best amplitude of an experiment, `bootstrap` gives intervals by resampling
realizations.
"""
