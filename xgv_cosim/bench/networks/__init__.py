"""Networks of the benchmark, made by ``tests/benchmarks/generate_networks.py``."""
