"""A parametric model of the BLA by maximum likelihood, with its uncertainty and its tests.

Begin with `fitting`: a `results.result.Result` goes in, a `fit_types.Fit` comes out. `samples`
weighs the lines of a BLA by their total covariance (`weights`); `rational` fits transfer functions
in the orthonormal polynomials of `basis`, `physical` describes rigid, two-inertia and three-inertia
joints, which `physical_fit` fits, both as `sampled` with hold and delay; `likelihood` ends every
fit. `uncertainty` gives intervals, `order_tests` judges the order and `order_search` chooses it.
`described_model` holds poles, zeros and gains, `nominal_values` the datasheet that `fjr diagnose`
takes. `fit_words` says it in sentences, `fit_output` writes all files with `fit_page`, `fit_plots`
and `fit_figures`, and `fit_control` hands the model to python-control.
"""
