"""Studies: experiments over many objects, one file each, by the name that `sgnlp study` knows them by."""

from sgnlp.studies import calibration, convergence
from sgnlp.studies.study import Study

STUDIES: dict[str, Study] = {
    "calibration": calibration.STUDY,
    "convergence": convergence.STUDY,
}
"""A study is one line here."""
