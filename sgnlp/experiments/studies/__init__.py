"""Studies: experiments over many objects, one file each, by their names in `sgnlp study`."""

from sgnlp.experiments.studies import (
    arm,
    calibration,
    comparison,
    confidence,
    contact,
    convergence,
    defaults,
    errors,
    hands,
    pose,
    stream,
    timing,
    triangles,
    weights,
)
from sgnlp.experiments.studies.study import Study

STUDIES: dict[str, Study] = {
    "arm": arm.STUDY,
    "calibration": calibration.STUDY,
    "comparison": comparison.STUDY,
    "confidence": confidence.STUDY,
    "contact": contact.STUDY,
    "convergence": convergence.STUDY,
    "defaults": defaults.STUDY,
    "errors": errors.STUDY,
    "hands": hands.STUDY,
    "pose": pose.STUDY,
    "stream": stream.STUDY,
    "time": timing.STUDY,
    "triangles": triangles.STUDY,
    "weights": weights.STUDY,
}
"""The studies; each is one line here."""
