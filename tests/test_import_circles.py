"""No module needs itself: what modules import when they run, at their head or inside functions, has no circle.

Imports for types only are left out: a contract may name the type of what implements it.
"""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

import grimp


def test_imports_have_no_circle() -> None:
    graph = grimp.build_graph("steptwin", exclude_type_checking_imports=True, cache_dir=None)
    assert len(graph.modules) > 500
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(reversed(error.args[1]))) from None
