"""Kernels: pure functions of float64 arrays, batched over leading axes; no files, no printing."""
