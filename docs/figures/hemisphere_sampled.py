"""A wrapper of a BSDF that keeps its values and draws cosine-weighted or uniform samples.

The documentation's part `sampling` compares these simple samplers with the plugin's own.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

# Distributions of the sampled directions: proportional to the cosine, and uniform in solid angle.
KINDS = ("cosine", "uniform")


def hemisphere_sampled(nested: mi.BSDF, kind: str) -> mi.BSDF:
    """The BSDF `nested` with samples of a `kind`, one of KINDS, in variants of Dr.Jit. Scalar variants do not work."""
    warps = {
        "cosine": (mi.warp.square_to_cosine_hemisphere, mi.warp.square_to_cosine_hemisphere_pdf),
        "uniform": (mi.warp.square_to_uniform_hemisphere, mi.warp.square_to_uniform_hemisphere_pdf),
    }
    to_direction, density = warps[kind]

    class HemisphereSampled(mi.BSDF):
        """Values of `nested` with samples and densities of `kind`, as one glossy component that reflects only.

        Directions are in the local frame with z along the normal; below the surface densities are 0. The methods are
        those of `mi.BSDF`.
        """

        def __init__(self, props):
            super().__init__(props)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            self.m_components = [flags]
            self.m_flags = flags

        # `sample1` would select a component, of which there is one.
        def sample(self, ctx, si, sample1, sample2, active=True):
            sample = mi.BSDFSample3f()
            sample.wo = to_direction(sample2)
            sample.pdf = density(sample.wo)
            # The relative index is 1, since the sample is not refracted.
            sample.eta = 1
            # The unary plus turns the flag into its integer.
            sample.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            sample.sampled_component = 0
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (sample.pdf > 0)
            # `eval` includes the cosine of the outgoing direction.
            weight = nested.eval(ctx, si, sample.wo, active) / sample.pdf
            return sample, dr.select(active, weight, 0)

        def eval(self, ctx, si, wo, active=True):
            return nested.eval(ctx, si, wo, active)

        def pdf(self, ctx, si, wo, active=True):
            above = (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
            return dr.select(active & above, density(wo), 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self):
            return f"HemisphereSampled[{kind}]"

    return HemisphereSampled(mi.Properties())
