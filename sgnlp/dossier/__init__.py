"""The report of a result: what is said (`content`), what to be wary of (`cautions`), and the pages it stands on."""

from sgnlp.dossier.content import Dossier, dossier
from sgnlp.dossier.pages import html, markdown

__all__ = ["Dossier", "dossier", "html", "markdown"]
