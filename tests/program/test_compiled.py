"""Compiled functions: the same bits as CasADi's machine, one build for every object, found again by its key."""

import lzma
import zlib
from dataclasses import fields, replace
from functools import partial

import casadi as ca
import numpy as np
import pytest
from carry import URDF, programs
from hands import THREE
from scenes import SMALL, hand
from test_architecture import MODULE_OF, imported

from sgnlp.base import toolchain
from sgnlp.base.errors import SolverError
from sgnlp.hand.hand import load_hand
from sgnlp.hand.placements import BACKENDS
from sgnlp.program import codegen, compiled, serialised
from sgnlp.program.constraint import Constraint
from sgnlp.program.constraints import preset_constraints
from sgnlp.program.formulations import formulation
from sgnlp.program.nlp import FUNCTIONS, build
from sgnlp.program.structure import structure
from sgnlp.program.terms import Term, preset_terms

STRUCTURE = structure(
    replace(SMALL, contact=replace(SMALL.contact, samples=2)),
    formulation("penalty"),
    preset_terms(SMALL),
    preset_constraints(SMALL),
)
"""Two samples: with three fingers and a few spheres a small program."""
small = partial(load_hand, THREE)

needs_a_compiler = pytest.mark.skipif(not compiled.can_compile(), reason="no C compiler")


@pytest.fixture(scope="module")
def cache():
    """The cache folder of all tests, where another one may have built the small program too."""
    compiled.load.cache_clear()
    yield toolchain.cache_folder()
    compiled.load.cache_clear()


@pytest.fixture(scope="module")
def built(cache):
    """The small program, compiled."""
    steps = []
    library = compiled.compile_program(small(), STRUCTURE, 2, lambda done, total: steps.append((done, total)))
    assert steps == [(i, len(steps)) for i in range(1, len(steps) + 1)]
    assert library.parent == cache
    return compiled.load(small(), STRUCTURE)


@needs_a_compiler
@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_compiled_function_gives_the_bits_of_casadis_machine(built, name):
    f, g = getattr(build(small(), STRUCTURE), name), getattr(built, name)
    rng = np.random.default_rng(0)
    for _ in range(3):
        arguments = [ca.DM(rng.uniform(0.5, 1.5, f.size_in(i))) for i in range(f.n_in())]
        for expected, found in zip(f.call(arguments), g.call(arguments), strict=True):
            assert expected.sparsity() == found.sparsity()
            np.testing.assert_array_equal(np.array(found.nonzeros()), np.array(expected.nonzeros()))


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The small program as it is kept in a cache of its own where it is not compiled: the file."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for known in (compiled.load, compiled.interpreted):
        known.cache_clear()
    nlp = build(small(), STRUCTURE)
    assert compiled.program(small(), STRUCTURE) is nlp
    compiled.keep(small(), STRUCTURE)
    compiled.interpreted.cache_clear()
    yield compiled.path(small(), STRUCTURE).with_suffix(".casadi")
    for known in (compiled.load, compiled.interpreted):
        known.cache_clear()


def test_functions_that_are_kept_are_those_that_were_built(kept, monkeypatch):
    nlp = build(small(), STRUCTURE)
    monkeypatch.setattr(compiled, "build", None)
    found = compiled.program(small(), STRUCTURE)
    assert found is not nlp
    for field in {field.name for field in fields(nlp)} - {*FUNCTIONS, "parameters", "units"}:
        assert getattr(found, field) == getattr(nlp, field)
    assert found.parameters.sizes == nlp.parameters.sizes
    for name in FUNCTIONS:
        assert getattr(found, name).serialize() == getattr(nlp, name).serialize()
    compiled.keep(small(), STRUCTURE)


def test_what_is_kept_and_damaged_or_not_readable_is_built_again(kept):
    for content in (kept.read_bytes()[:-1], b""):
        kept.write_bytes(content)
        assert compiled.program(small(), STRUCTURE) is build(small(), STRUCTURE)
        compiled.interpreted.cache_clear()
    kept.unlink()
    for text in (b"", b"none", zlib.compress(b"[1]\nno function"), zlib.compress(b"none")):
        toolchain.keep(kept, text)
        assert compiled.program(small(), STRUCTURE) is build(small(), STRUCTURE)
        compiled.interpreted.cache_clear()


def test_nothing_is_kept_where_it_cannot_be_found_again_or_is_compiled_without(kept):
    other = replace(STRUCTURE, terms=(*STRUCTURE.terms, type("Own", (Term,), {})()))
    compiled.keep(small(), other)
    assert list(kept.parent.glob("*.casadi")) == [kept]
    assert compiled.program(small(), STRUCTURE, compiled=False) is build(small(), STRUCTURE)


def test_functions_that_the_package_carries_are_found_and_not_kept_again(kept, tmp_path, monkeypatch):
    nlp, carried = build(small(), STRUCTURE), tmp_path / compiled.file_name(small(), STRUCTURE)
    kept.unlink()
    carried.write_bytes(lzma.compress(serialised.written(nlp), preset=0))
    monkeypatch.setattr(compiled, "beside", lambda name: tmp_path / name if (tmp_path / name).exists() else None)
    compiled.keep(small(), STRUCTURE)
    assert not kept.exists()
    with monkeypatch.context() as patched:
        patched.setattr(compiled, "build", None)
        assert compiled.program(small(), STRUCTURE).hessian.serialize() == nlp.hessian.serialize()
    for content in (carried.read_bytes()[:-9], b"", lzma.compress(b"none")):
        carried.write_bytes(content)
        compiled.interpreted.cache_clear()
        assert compiled.program(small(), STRUCTURE) is nlp


def test_what_the_package_carries_is_what_is_built():
    there, wanted = set(URDF.glob("*/program-*.xz")), programs()
    assert there in (set(), set(wanted)), "not in step: python tests/carry.py"
    for file in there:
        sizes, functions = serialised.read(lzma.decompress(file.read_bytes()))
        nlp = build(*wanted[file])
        assert sizes == nlp.row_sizes
        for name in FUNCTIONS:
            assert_same(functions[name], getattr(nlp, name))


def assert_same(found: ca.Function, expected: ca.Function):
    """Two functions are one, but for constants that differ by as much as one machine's sine and another's."""
    assert found.n_instructions() == pytest.approx(expected.n_instructions(), rel=0.01)
    rng = np.random.default_rng(0)
    given = [rng.uniform(0.1, 1.0, found.size_in(i)) for i in range(found.n_in())]
    for one, other in zip(found.call(given), expected.call(given), strict=True):
        assert one.sparsity() == other.sparsity()
        values = np.array(other.nonzeros())
        np.testing.assert_allclose(one.nonzeros(), values, rtol=1e-7, atol=1e-9 * np.abs(values).max(initial=0.0))


def test_the_name_of_what_is_carried_tells_hands_structures_and_sources_apart(monkeypatch):
    names = {compiled.file_name(small(), STRUCTURE), compiled.file_name(small(), replace(STRUCTURE, samples=3))}
    names.add(compiled.file_name(hand(), STRUCTURE))
    monkeypatch.setattr(ca, "__version__", "0.0.0")
    monkeypatch.setenv("CC", "true")
    assert compiled.file_name(small(), STRUCTURE) in names
    monkeypatch.setattr(compiled, "_package", lambda: b"another")
    names.add(compiled.file_name(small(), STRUCTURE))
    assert len(names) == 4


@needs_a_compiler
def test_a_compiled_program_takes_the_place_of_the_kept_one(kept, monkeypatch):
    monkeypatch.setattr(compiled, "_sources", lambda name, made: {f"{name}.c": f"int {name}(void){{return 0;}}"})
    library = compiled.compile_program(small(), STRUCTURE)
    assert library.exists()
    assert not kept.exists()


@needs_a_compiler
def test_a_compiled_program_is_the_interpreted_one_in_everything_else(built):
    nlp = build(small(), STRUCTURE)
    assert built.row_sizes == nlp.row_sizes
    assert built.terms_used == nlp.terms_used
    assert built.constraints == nlp.constraints
    assert built.layout == nlp.layout
    assert built.parameters.sizes == nlp.parameters.sizes


@needs_a_compiler
def test_what_is_built_is_found_and_not_built_again(built, cache):
    before = {path: path.stat().st_mtime_ns for path in cache.glob("program-*.so")}
    compiled.compile_program(small(), STRUCTURE)
    assert {path: path.stat().st_mtime_ns for path in cache.glob("program-*.so")} == before
    assert compiled.program(small(), STRUCTURE).points.class_name() != "SXFunction"
    assert compiled.program(small(), STRUCTURE, compiled=False) is build(small(), STRUCTURE)


def test_another_hand_preset_structure_or_compiler_has_another_key(monkeypatch):
    constrained = replace(STRUCTURE, formulation=formulation("constrained"))
    moved = replace(STRUCTURE.constraints[0], name="another")
    keys = {compiled.path(hand(), STRUCTURE), compiled.path(hand("paper"), STRUCTURE)}
    keys |= {
        compiled.path(hand(), replace(STRUCTURE, samples=3)),
        compiled.path(hand(), replace(STRUCTURE, density="x")),
        compiled.path(hand(), replace(STRUCTURE, terms=STRUCTURE.terms[1:])),
        compiled.path(hand(), replace(STRUCTURE, constraints=STRUCTURE.constraints[1:])),
        compiled.path(hand(), replace(STRUCTURE, constraints=(moved, *STRUCTURE.constraints[1:]))),
        compiled.path(hand(), constrained),
    }
    monkeypatch.setattr(ca, "__version__", "0.0.0")
    keys.add(compiled.path(hand(), STRUCTURE))
    monkeypatch.setenv("CC", "true")
    keys.add(compiled.path(hand(), STRUCTURE))
    assert len(keys) == 10
    elastic = replace(STRUCTURE, formulation=formulation("elastic"))
    monkeypatch.undo()
    walking = load_hand("allegro_left", kinematics=BACKENDS[-1])
    same = compiled.path(walking, STRUCTURE) == compiled.path(hand(), STRUCTURE)
    assert same == (hand().kinematics == BACKENDS[-1])
    assert compiled.path(hand(), elastic) == compiled.path(hand(), constrained)


def test_what_has_no_source_that_is_known_is_not_compiled_and_what_has_one_has_it_in_its_key():
    class Own(Term):
        def value(self, g, op):
            return op.sum(g.gains)

    def within(**source):
        return replace(STRUCTURE, constraints=(*STRUCTURE.constraints, Constraint("own", lambda g, op: 1, **source)))

    assert compiled.path(hand(), replace(STRUCTURE, terms=(*STRUCTURE.terms, Own()))) is None
    assert compiled.path(hand(), within()) is None
    with pytest.raises(SolverError, match="no file"):
        compiled.compile_program(hand(), within())
    paths = {compiled.path(hand(), within(source=source)) for source in ("a", "b")}
    assert len(paths) == 2
    assert None not in paths
    Own.source = "c"
    assert compiled.path(hand(), replace(STRUCTURE, terms=(*STRUCTURE.terms, Own()))) is not None


def test_the_key_covers_every_module_that_a_program_is_made_of():
    todo, found = ["sgnlp.program.nlp", "sgnlp.program.codegen"], set()
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            todo += imported(MODULE_OF[name]) & set(MODULE_OF)
    assert {name.split(".")[1] for name in found} == set(compiled.ROOMS)


def test_what_is_not_in_the_cache_or_is_damaged_is_interpreted(cache):
    other = replace(STRUCTURE, samples=3)
    assert compiled.load(small(), other) is None
    library = compiled.path(small(), other)
    library.parent.mkdir(parents=True, exist_ok=True)
    library.write_bytes(b"no library")
    compiled.load.cache_clear()
    assert compiled.program(small(), other) is build(small(), other)
    library.unlink()


def test_without_a_compiler_a_build_says_so(cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    assert not compiled.can_compile()
    with pytest.raises(SolverError, match="no C compiler"):
        compiled.compile_program(small(), replace(STRUCTURE, samples=4))


@needs_a_compiler
def test_numbers_that_outlive_their_piece_and_every_operation_survive_the_cut(tmp_path, monkeypatch):
    monkeypatch.setattr(codegen, "PIECE", 5)
    x = ca.SX.sym("x", 3)
    y = ca.vertcat(
        ca.sin(x[0]) * ca.exp(x[1]) + x[2] ** 3, ca.fmax(x[0], x[1]) / ca.sqrt(x[2]), ca.atan2(x[0], x[2]) - ca.pi,
        ca.if_else(x[0] < x[1], x[2], -x[0]), ca.log1p(x[0]) + ca.fabs(-x[1]) + ca.sign(x[2] - 1), ca.asinh(x[0]), 7.0,
    )  # fmt: skip
    f = ca.Function("f", [x], [y, ca.jacobian(y, x)])
    toolchain.build(tmp_path / "f.so", codegen.sources(f), compiled.FLAGS)
    g = ca.external("f", str(tmp_path / "f.so"))
    for point in ([0.3, 0.8, 1.4], [1.2, 0.1, 0.6]):
        for expected, found in zip(f(point), g(point), strict=True):
            np.testing.assert_array_equal(np.array(found), np.array(expected))


@needs_a_compiler
def test_a_compiler_error_leaves_nothing_behind(tmp_path):
    with pytest.raises(SolverError, match=r"fails: f\.c:1.* error: .*; name another in CC"):
        toolchain.build(tmp_path / "f.so", {"f.c": "this is not C"}, ())
    assert not list(tmp_path.iterdir())
