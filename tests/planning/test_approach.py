"""The density of contact along the fingers' paths is the one that E_uncer is made of."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, exact_grasp, posed, pregrasp, random_point, unbuilt

from sgnlp.planning.approach import approaches
from sgnlp.program.ops import Exact
from sgnlp.program.terms.contact import Uncertainty


@pytest.mark.parametrize("density", ["share", "density"])
def test_the_paths_add_up_to_the_term_of_the_energy(density):
    problem = posed(SMALL)
    nlp = unbuilt(problem)
    start, x = random_point(problem, nlp, 3)
    problem = replace(problem, settings=replace(SMALL, contact=replace(SMALL.contact, density=density)))
    g, at = exact_grasp(problem, start, x), pregrasp(problem, start, x)
    found = approaches(problem, at)
    total = sum(path.sample_density.mean() - path.contact_density for path in found)
    assert total == pytest.approx(float(Uncertainty().value(g, Exact())), rel=1e-12)
    for i, path in enumerate(found):
        assert path.way[-1] == pytest.approx(np.linalg.norm(g.targets[i] - g.tips[i]))
        assert path.contact_way == pytest.approx(np.linalg.norm(g.contacts[i] - g.tips[i]))
        np.testing.assert_allclose(np.interp(path.sample_way, path.way, path.gap), path.gap[::1][_at(path)], atol=2e-4)
        np.testing.assert_allclose(path.density[[0, -1]], path.sample_density[[0, -1]], rtol=1e-12)


def _at(path) -> np.ndarray:
    """The points of the fine path nearest to the samples."""
    return np.abs(path.way[:, None] - path.sample_way).argmin(axis=0)
