"""Order efficiencies of gratings: independent rigorous solvers (judges), and the project's theories.

Gratings lie along x and their grooves along y; light comes in across the grooves (classical mount) unless an azimuth is
given. Lengths are in um, wavelengths in nm. `theta_i_deg` is the angle of `wi` with the normal, positive where
`wi.x = sin θi` is; order j leaves at `wo.x = jλ/period − sin θi`, as in the rest of the project.
"""
