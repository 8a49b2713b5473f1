"""Order efficiencies of dielectric reliefs that repeat along x and y, by Maxwell's equations, to judge skins by.

Lengths are in um, wavelengths in nm. Heights are `[iy, ix]`, rows growing along +y. Light comes from
`wi = (sinθ cosφ, sinθ sinφ, cosθ)`, and order (jx, jy) leaves at `wo_xy = λ (jx/Lx, jy/Ly) − wi_xy`, as in the rest of
the project. Fields are proportional to exp(−iωt).
"""
