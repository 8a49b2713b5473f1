"""A judge of skins: efficiencies of orders of dielectric reliefs that repeat along x and y, by Maxwell's equations.

A *judge* is a solver that is independent of the project's own. Lengths are in µm, wavelengths in nm. Heights are
`[iy, ix]` with y = 0 first. `wi = (sinθ cosφ, sinθ sinφ, cosθ)` is the unit vector to the light. Order (jx, jy) leaves
along the unit vector `wo` with `wo_xy = λ (jx/Lx, jy/Ly) − wi_xy`, as in the rest of the project; Lx and Ly are the
periods. Fields are proportional to exp(−iωt).
"""
