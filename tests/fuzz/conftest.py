"""How many cases the fuzz suites try: a few by default, 10⁴ each with POREFV_FUZZ=nightly."""

from hypothesis import HealthCheck, settings

quiet = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
settings.register_profile("fuzz", deadline=None, max_examples=60, suppress_health_check=quiet)
settings.register_profile("fuzz-nightly", deadline=None, max_examples=10_000, suppress_health_check=quiet)
