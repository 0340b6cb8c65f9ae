"""The factors of Ipopt's linear systems in C, which Ipopt loads as it loads HSL's library.

A system of a hand's program has some 640 unknowns: variables, slacks of the inequalities and rows. `kkt_factors.c`
leaves the slacks and their rows out, and factors what remains, some 70 unknowns, as a dense matrix. The steps are those
of MUMPS but for rounding.
"""

from sgnlp.base.c_library import CLibrary

SOURCES = ("kkt_factors.c", "dense_ldl.c")
LIBRARY = CLibrary("kkt", "sgnlp.planning.solvers", SOURCES, "-O3", ("ma27id_", "ma27ad_", "ma27bd_", "ma27cd_"))


def options() -> dict[str, object]:
    """Ipopt's options to use them, in CasADi's names; empty where there is no C compiler."""
    if LIBRARY.load() is None:
        return {}
    return {
        "ipopt.linear_solver": "ma27",
        "ipopt.hsllib": str(LIBRARY.path),
        "ipopt.linear_system_scaling": "none",  # variables and rows are scaled already
        "ipopt.ma27_la_init_factor": 1.0,  # the factors tell the room that they need
        "ipopt.ma27_liw_init_factor": 1.0,
    }
