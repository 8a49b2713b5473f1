"""Order efficiencies of gratings: by solvers that are independent of the project (*judges*), and by its theories.

Gratings repeat along x, with their grooves along y. Light comes across the grooves (classical mount), unless an azimuth
is given. Lengths are in µm, wavelengths in nm. `wi` and `wo` are unit vectors to the light and along an order.
`theta_i_deg` is the angle θi of `wi` with the normal, with the sign of `wi.x = sin θi`. Order j leaves at
`wo.x = jλ/period − sin θi`, as in the rest of the project.
"""
