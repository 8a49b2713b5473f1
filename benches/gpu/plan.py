"""Sizes, variants and surfaces of a run with a card, and of a dry run that tests the code without one."""

from __future__ import annotations

from dataclasses import dataclass

# Methods of the realtime renderer (docs/realtime.md).
METHODS = ("flss", "nmm", "pq", "stam", "table")


@dataclass(frozen=True)
class Plan:
    """Sizes, variants and surfaces of one run. Sizes of pictures are (width, height) in pixels."""

    # Whether this is a dry run, without a card.
    dry: bool
    # Backend of Dr.Jit: `cuda` or `llvm`.
    backend: str
    # Value of the option `--adapter` of `sunbeam` for the card's pictures: `any`, which prefers a GPU, or `software`.
    adapter: str
    # Whether the card's pictures are drawn; otherwise they lie in the folder `--pictures`, from another machine.
    draws: bool
    # Number of questions (questions.py) to each BSDF: sets of arguments for which it is called.
    questions: int
    # Number of questions to a BSDF of a scalar variant, which answers one by one.
    scalar_questions: int
    # Names of the surfaces (surfaces.py) whose answers are compared with those of the reference variant (agreement.py).
    surfaces: tuple[str, ...]
    # Names of the surfaces whose samples are tested (samples.py).
    sampled: tuple[str, ...]
    # Ends of the names of the variants that are checked and timed, such as `rgb`. The parts `agree-*` (parts.py) have
    # their own.
    kinds: tuple[str, ...]
    # Names of the parameters by which derivatives are taken.
    derivatives: tuple[str, ...]
    # Parameters of the snake's skin, for plugin and command.
    skin: dict
    # Resolution of the snake's mesh: cells in each direction, as a multiple of the default.
    mesh_resolution: float
    # Size of the path-traced snake's pictures.
    snake_size: tuple[int, int]
    # Samples per pixel of the path-traced snake.
    snake_spp: int
    # Number of pictures of the path-traced snake with different seeds.
    snake_pictures: int
    # Number of questions that a timed call answers at once (calls.py).
    wavefront: int
    # Names of the materials of timed calls, in `bsdfs` of docs/figures/bsdf_calls.py.
    materials: tuple[str, ...]
    # Names of the timed calls.
    calls: tuple[str, ...]
    # Names of the benchmark scenes (docs/figures/benchmark_scenes.py) whose renders are timed.
    scenes: tuple[str, ...]
    # Size of a timed render.
    render_size: tuple[int, int]
    # Samples per pixel of a timed render.
    render_spp: int
    # Number of timed renders after the first, which includes the compilation.
    renders: int
    # Names of the surfaces (surfaces.py) whose kernels are inspected.
    inspected: tuple[str, ...]
    # Methods of the realtime renderer.
    methods: tuple[str, ...]
    # Sizes of the realtime renderer's timed frames.
    frame_sizes: tuple[tuple[int, int], ...]
    # Number of frames of which the median time is taken.
    frames: int
    # Side in pixels of the realtime renderer's compared pictures, which are squares.
    compared_side: int

    def variant(self, kind: str) -> str:
        """The variant of Mitsuba that is checked, for instance `cuda_ad_rgb`."""
        return f"{self.backend}_ad_{kind}"


# A run with a card. Sizes are chosen so that all parts take about the estimates of parts.py.
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

# A run that tests the code without a card.
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
    # Wide orders: narrow ones light too few pixels of a small picture.
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
