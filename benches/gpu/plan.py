"""Sizes, variants and surfaces of a run: of a card, and of the dry run that proves the code without one."""

from __future__ import annotations

from dataclasses import dataclass

KINDS = ("rgb", "mono", "spectral", "spectral_polarized")
METHODS = ("flss", "nmm", "pq", "stam", "table")


@dataclass(frozen=True)
class Plan:
    """Sizes, variants and surfaces of one run. Sizes of pictures are (width, height) in pixels."""

    dry: bool
    # Backend of Dr.Jit: `cuda`, or `llvm` in its place.
    backend: str
    # Value of `--adapter` for what the card draws.
    adapter: str
    # Whether the card's pictures are drawn here, or lie in the folder already.
    draws: bool
    # Questions of each BSDF, and of a scalar variant that answers them one by one.
    questions: int
    scalar_questions: int
    # Surfaces by name (see `surfaces.py`): those held against the reference, and those whose samples are tested.
    surfaces: tuple[str, ...]
    sampled: tuple[str, ...]
    # Kinds of variants that parts other than the agreement run in.
    kinds: tuple[str, ...]
    # Parameters by which is differentiated.
    derivatives: tuple[str, ...]
    # The snake's skin, as parameters that plugin and command share, and the resolution of its mesh.
    skin: dict
    mesh_resolution: float
    # The snake beside its reference: size, samples a pixel, pictures of different seeds.
    snake_size: tuple[int, int]
    snake_spp: int
    snake_pictures: int
    # One call: elements of a wavefront, names in `bsdf_calls.bsdfs`, and the calls.
    wavefront: int
    materials: tuple[str, ...]
    calls: tuple[str, ...]
    # Benchmark scenes by name, size, samples a pixel, and renders after the first.
    scenes: tuple[str, ...]
    render_size: tuple[int, int]
    render_spp: int
    renders: int
    # Surfaces whose kernels are inspected.
    inspected: tuple[str, ...]
    # The realtime renderer: methods, sizes, frames of which the median counts; side of what is compared.
    methods: tuple[str, ...]
    frame_sizes: tuple[tuple[int, int], ...]
    frames: int
    compared_side: int

    def variant(self, kind: str) -> str:
        """The variant of Mitsuba that is checked, for instance `cuda_ad_rgb`."""
        return f"{self.backend}_ad_{kind}"


CARD = Plan(
    dry=False,
    backend="cuda",
    adapter="any",
    draws=True,
    questions=1 << 20,
    scalar_questions=1 << 13,
    surfaces=("blazed", "xenopeltis", "scan", "aluminium grating", "rigorous grating"),
    sampled=("blazed", "xenopeltis", "rigorous grating"),
    kinds=("rgb", "spectral"),
    derivatives=("eta", "k", "specular_reflectance", "diffuse_reflectance", "rotation"),
    skin={"preset": "xenopeltis"},
    mesh_resolution=4.0,
    snake_size=(192, 128),
    snake_spp=64,
    snake_pictures=8,
    wavefront=1 << 24,
    materials=("blazed", "xenopeltis", "roughconductor"),
    calls=("eval", "pdf", "eval_pdf", "sample"),
    scenes=("sphere", "snake", "disc", "scan"),
    render_size=(1920, 1080),
    render_spp=64,
    renders=3,
    inspected=("blazed", "xenopeltis", "rigorous grating"),
    methods=METHODS,
    frame_sizes=((512, 512), (1920, 1080), (3840, 2160)),
    frames=9,
    compared_side=512,
)

DRY_RUN = Plan(
    dry=True,
    backend="llvm",
    adapter="software",
    draws=True,
    questions=1 << 10,
    scalar_questions=1 << 10,
    surfaces=("blazed", "scan", "perfect grating"),
    sampled=("blazed",),
    kinds=("rgb",),
    derivatives=("eta", "rotation"),
    # Wide orders: narrow ones are glints on few pixels of a small picture.
    skin={"preset": "blazed", "coherence_length": 5.0},
    mesh_resolution=1.0,
    snake_size=(24, 16),
    snake_spp=16,
    snake_pictures=8,
    wavefront=1 << 14,
    materials=("blazed", "roughconductor"),
    calls=("eval", "sample"),
    scenes=("scan",),
    render_size=(48, 32),
    render_spp=4,
    renders=2,
    inspected=("blazed",),
    methods=("table",),
    frame_sizes=((64, 64),),
    frames=2,
    compared_side=64,
)
