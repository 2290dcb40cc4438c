"""Texts of scene files with segments."""

from __future__ import annotations

CHAIN_SECTION = """
[chain]
granules = 6
radius = "4.75 mm"
young_modulus = "193 GPa"
poisson_ratio = 0.3
density = "7958 kg/m^3"
"""
SEGMENTS = """
[[chain.segments]]
granules = 4
cell = [{}, { young_modulus = "1.46 GPa", poisson_ratio = 0.46, density = "2.2 g/cm^3" }]
[[chain.segments]]
granules = 2
radius = "4 mm"
radius_ratio = 0.9
gap = "1 um"
"""
SHOCK = """
[shock]
profile = "cosine"
peak_force = "100 N"
duration_ratio = 2
momentum_ratio = 1.0
"""
