"""C code of a CasADi SX function, cut into pieces that a compiler handles in linear time and memory.

CasADi writes one C function for each `Function`. For more than 10⁵ lines a compiler then needs minutes and gigabytes.
Here the instructions become pieces of `PIECE` lines, and values needed in later pieces go through a work vector. The C
files follow the interface of `casadi.external`. The operations and their order are those of CasADi's virtual machine,
so without contraction of products and sums both give the same bits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca

PIECE = 500
"""Instructions in a piece: the compiler needs a few tenths of a second and 100 MB for it."""
PIECES_IN_A_FILE = 10

UNARY = {
    "OP_ASSIGN": "{0}", "OP_NEG": "-{0}", "OP_SQ": "{0}*{0}", "OP_TWICE": "2*{0}", "OP_INV": "1./{0}",
    "OP_FABS": "fabs({0})", "OP_SIGN": "(({0}>0)-({0}<0))", "OP_NOT": "!{0}",
    **{f"OP_{name.upper()}": f"{name}({{0}})" for name in (
        "exp", "log", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh",
        "atanh", "log1p", "expm1", "erf", "floor", "ceil")},
}  # fmt: skip
BINARY = {
    "OP_ADD": "{0}+{1}", "OP_SUB": "{0}-{1}", "OP_MUL": "{0}*{1}", "OP_DIV": "{0}/{1}", "OP_LT": "({0}<{1})",
    "OP_LE": "({0}<={1})", "OP_EQ": "({0}=={1})", "OP_NE": "({0}!={1})", "OP_AND": "({0}&&{1})", "OP_OR": "({0}||{1})",
    "OP_IF_ELSE_ZERO": "({0}?{1}:0)", "OP_CONSTPOW": "pow({0},{1})",
    **{f"OP_{name.upper()}": f"{name}({{0}},{{1}})" for name in ("pow", "fmin", "fmax", "atan2", "copysign", "hypot")},
}  # fmt: skip
OPERATIONS = {getattr(ca, name): (form, n) for n, forms in ((1, UNARY), (2, BINARY)) for name, form in forms.items()}


@dataclass(frozen=True)
class _Instruction:
    """An operation on the values of earlier instructions; a leaf has the C text of its value instead."""

    operation: int
    reads: tuple[int, ...]
    leaf: str = ""
    target: tuple[int, int] = (0, 0)
    """For an output: its number and the number of its element."""


def sources(function: ca.Function) -> dict[str, str]:
    """Names and texts of the C files of an SX function; compiled and linked, they serve `casadi.external`."""
    name, (bodies, slots) = function.name(), _pieces(_instructions(function))
    files = {}
    for i in range(0, len(bodies), PIECES_IN_A_FILE):
        texts = [
            f"void {name}_piece{j}(const double**arg,double**res,double*w){{\n{body}}}\n"
            for j, body in enumerate(bodies[i : i + PIECES_IN_A_FILE], start=i)
        ]
        files[f"{name}_{i // PIECES_IN_A_FILE}.c"] = "#include <math.h>\n" + "".join(texts)
    files[f"{name}.c"] = _interface(function, len(bodies), slots)
    return files


def _instructions(function: ca.Function) -> list[_Instruction]:
    """The instructions; operands refer to the instruction that computed them instead of to work slots."""
    home: dict[int, int] = {}  # work slot → the instruction whose value it holds
    code = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        inputs, outputs = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            code.append(_Instruction(operation, (home[inputs[0]],), target=(outputs[0], outputs[1])))
            continue
        if operation == ca.OP_INPUT:
            code.append(_Instruction(operation, (), f"(arg[{inputs[0]}]?arg[{inputs[0]}][{inputs[1]}]:0)"))
        elif operation == ca.OP_CONST:
            code.append(_Instruction(operation, (), _number(function.instruction_constant(k))))
        else:
            code.append(_Instruction(operation, tuple(home[i] for i in inputs[: OPERATIONS[operation][1]])))
        home[outputs[0]] = k
    return code


def _number(value: float) -> str:
    return {float("inf"): "INFINITY", float("-inf"): "(-INFINITY)"}.get(value, f"({value!r})")


def _pieces(code: Sequence[_Instruction]) -> tuple[list[str], int]:
    """Bodies of the pieces and the length of the work vector."""
    last = {d: k // PIECE for k, instruction in enumerate(code) for d in instruction.reads}  # piece of the last reader
    slot: dict[int, int] = {}  # instruction → its index in the work vector, while it is needed
    free: list[int] = []
    bodies, slots = [], 0
    for start in range(0, len(code), PIECE):
        now, stop = start // PIECE, min(start + PIECE, len(code))
        kept = [k for k in range(start, stop) if not code[k].leaf and last.get(k, now) > now]
        while len(free) < len(kept):
            free.append(slots)
            slots += 1
        slot |= {k: free.pop() for k in kept}
        bodies.append("".join(_lines(code, start, stop, slot)))
        for k in [k for k in slot if last[k] == now]:
            free.append(slot.pop(k))
    return bodies, slots


def _lines(code: Sequence[_Instruction], start: int, stop: int, slot: dict[int, int]) -> Iterator[str]:
    """The C lines of a piece."""
    known: set[int] = set()
    for k in range(start, stop):
        instruction = code[k]
        for d in instruction.reads:
            if d not in known:
                yield f"double v{d}={code[d].leaf or f'w[{slot[d]}]'};\n"
                known.add(d)
        if instruction.operation == ca.OP_OUTPUT:
            i, j = instruction.target
            yield f"if(res[{i}])res[{i}][{j}]=v{instruction.reads[0]};\n"
        elif not instruction.leaf:  # leaves are written where they are read
            form = OPERATIONS[instruction.operation][0].format(*[f"v{d}" for d in instruction.reads])
            yield f"double v{k}={f'w[{slot[k]}]=' if k in slot else ''}{form};\n"
            known.add(k)


def _interface(function: ca.Function, pieces: int, slots: int) -> str:
    """The functions that `casadi.external` requires."""
    name, n_in, n_out = function.name(), function.n_in(), function.n_out()
    ins = [(function.name_in(i), function.sparsity_in(i)) for i in range(n_in)]
    outs = [(function.name_out(i), function.sparsity_out(i)) for i in range(n_out)]
    calls = "".join(f"{name}_piece{j}(arg,res,w);" for j in range(pieces))
    declared = "".join(f"void {name}_piece{j}(const double**,double**,double*);\n" for j in range(pieces))
    return (
        f"{declared}{_table(name, 'in', ins)}{_table(name, 'out', outs)}"
        f"int {name}(const double**arg,double**res,long long*iw,double*w,int mem){{{calls}return 0;}}\n"
        f"int {name}_work(long long*a,long long*r,long long*i,long long*w)"
        f"{{if(a)*a={n_in};if(r)*r={n_out};if(i)*i=0;if(w)*w={slots};return 0;}}\n"
    )


def _table(name: str, kind: str, places: list[tuple[str, ca.Sparsity]]) -> str:
    """Number, names and sparsity patterns of the inputs or outputs."""
    patterns = [[*s.shape, 1] if s.is_dense() else [*s.shape, *s.colind(), *s.row()] for _, s in places]
    data = [f"static const long long {name}_{kind}{i}[]={{{','.join(map(str, p))}}};\n" for i, p in enumerate(patterns)]
    sparsity = "".join(f"case {i}:return {name}_{kind}{i};" for i in range(len(places)))
    names = "".join(f'case {i}:return "{n}";' for i, (n, _) in enumerate(places))
    return (
        f"{''.join(data)}long long {name}_n_{kind}(void){{return {len(places)};}}\n"
        f"const long long*{name}_sparsity_{kind}(long long i){{switch(i){{{sparsity}default:return 0;}}}}\n"
        f"const char*{name}_name_{kind}(long long i){{switch(i){{{names}default:return 0;}}}}\n"
    )
