"""Solvers of the pressure equation on a network of links: direct and iterative."""

from porefv.solvers.network import Network
from porefv.solvers.pressure_equation import NetworkSolution, solve_network
from porefv.solvers.solver import SOLVERS, Solver, SolverReport

__all__ = ["SOLVERS", "Network", "NetworkSolution", "Solver", "SolverReport", "solve_network"]
