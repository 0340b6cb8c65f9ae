"""The report of a result: its content (`content`, `figures`), and its pages in HTML and Markdown (`pages`)."""
