"""The report of a result: what it says (`content`, `figures`), and the pages that it stands on (`pages`)."""
