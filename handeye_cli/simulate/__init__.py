"""Recordings and measurements with a known truth, made from nothing but geometry and chance."""
