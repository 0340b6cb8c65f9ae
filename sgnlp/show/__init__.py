"""Tables, figures, three-dimensional views and reports.

Plans, results and rows come in; texts, pictures and pages go out. Nothing is printed here. It knows the rooms before
it, `planning` and `simulation` among them.
"""
