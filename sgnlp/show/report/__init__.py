"""The report of a result: what is said (`content`), what to be wary of (`cautions`), and the pages it stands on."""

from sgnlp.show.report.content import Dossier, dossier
from sgnlp.show.report.pages import html, markdown

__all__ = ["Dossier", "dossier", "html", "markdown"]
