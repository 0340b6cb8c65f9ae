"""The nonlinear program: a grasp, its energy and its constraints, with exact derivatives.

A `Hand` and a `Structure` come in, an `Nlp` goes out: functions of the variables that serve every object; `oracle`
joins them with a surface. It imports from `base`, `surface` and `hand`.
"""
