"""The nonlinear program: what a grasp is, what it costs, what it must meet, with exact derivatives.

A `Hand` and a `Structure` come in, an `Nlp` goes out: functions of the variables that serve every object; `oracle`
joins them with a surface. It knows `base`, `surface` and `hand`.
"""
