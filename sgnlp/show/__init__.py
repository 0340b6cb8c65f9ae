"""Tables, figures, three-dimensional views and reports.

Plans, results and rows come in; texts, pictures and pages go out. Nothing is printed here. It imports from the rooms
before it, among them `planning` and `simulation`.
"""
