"""Comparison of methods on a scene of the user's: error of each against its time and memory (`porefv trade`)."""

from porefv.system.lazy_exports import lazy_exports

__all__ = ["Method", "MethodComparison", "MethodResult", "compare"]
__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "Method": "porefv.comparison.methods",
        "MethodComparison": "porefv.comparison.comparison",
        "MethodResult": "porefv.comparison.measurement",
        "compare": "porefv.comparison.comparison",
    },
)
