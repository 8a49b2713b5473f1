# Everything from a fresh clone: `make plugin`, `make test`, `make demo`. Needs Rust, Python >= 3.9, a C++17 compiler.

PYTHON ?= python3
PY     := .venv/bin/python
READY  := .venv/.ready
FORMATS := .venv/.formats
# One line for each skipped test of the last `make test`.
SKIPS := target/skips.txt
PLUGIN := target/mitsuba/plugins/diffraction.so
LIBRARY := target/c_abi
CARGO  := cargo
# What the library begins with.
GROUND := -p sunbeam-fourier -p sunbeam-height-field -p sunbeam-rigorous -p sunbeam-unify --features sunbeam-height-field/files
# Fixed, because Mitsuba's file resolver and the documentation name it.
export CARGO_TARGET_DIR := target
export SUNBEAM_SKIPS := $(CURDIR)/$(SKIPS)

# Tests start hundreds of interpreters, and packages come without their modules compiled (scripts/setup.sh): where the
# environment forbids keeping these, as images of containers do, each would compile them once more.
unexport PYTHONDONTWRITEBYTECODE

# Two builds at a time would only wait for each other.
.NOTPARALLEL:
.PHONY: all setup plugin tool library header test check new-skips test-rust test-python test-versions wheel lint format demo scenes crosscheck bench bench-gpu figures docs api-docs web web-serve test-web bench-web clean help

all: plugin

help:
	@echo "make plugin   build $(PLUGIN)"
	@echo "make tool     build target/release/sunbeam"
	@echo "make library  build $(LIBRARY)/lib/libsunbeam.{so,a} and its header, for C"
	@echo "make test     build and run every test"
	@echo "make test-versions  test the plugin with each Mitsuba that it can be compiled for"
	@echo "make wheel    the Python package with a plugin for each of these, out/wheel/"
	@echo "make lint     check formatting and lints; make format mends the former"
	@echo "make demo     render the snake and compare the renderers, results in out/"
	@echo "make scenes   write scenes for the mitsuba command, and the files that they need, into out/scenes/"
	@echo "make crosscheck  compare the renderers alone, results in out/crosscheck/"
	@echo "make figures  make every page of figures in docs/ anew; or one: make figures PAGES=brdf-maps"
	@echo "make docs     build the documentation, target/docs/index.html; make api-docs that of the Rust API"
	@echo "make web      build the page for browsers, target/web/; make web-serve opens it to this machine's browsers"
	@echo "make test-web the part of make test that tests it in headless Chromium; make bench-web measures it there"
	@echo "make bench-gpu  check and time a machine with an NVIDIA card, results in docs/data/gpu.json; a dry run elsewhere."
	@echo "              PARTS names some of its parts: .venv/bin/python -m benches.gpu --list"
	@echo "make bench | clean"

setup: $(READY)

# Packages come over the network while that is compiled which needs none of them. Its errors are told by the build that follows,
# in which the plugin's C++ is compiled beside the library.
$(READY): requirements.lock scripts/setup.sh
	@$(CARGO) build --release --quiet $(GROUND) >/dev/null 2>&1 & compiling=$$!; \
	PYTHON="$(PYTHON)" scripts/setup.sh; ready=$$?; \
	[ $$ready = 0 ] || kill $$compiling 2>/dev/null; wait $$compiling; exit $$ready

# The library that reads instruments' files, for its tests alone: 62 MB of wheels.
$(FORMATS): requirements-formats.lock $(READY)
	$(PY) -m pip install --quiet --disable-pip-version-check --no-compile --only-binary=:all: -r $<
	@touch $@

# Cargo knows what is out of date. The copy is replaced in one step, since a running Mitsuba may have it mapped.
plugin: $(READY)
	$(CARGO) build --release -p sunbeam-mitsuba
	@mkdir -p $(dir $(PLUGIN))
	@cmp -s target/release/libsunbeam_mitsuba.so $(PLUGIN) || \
		{ cp target/release/libsunbeam_mitsuba.so $(PLUGIN).new && mv $(PLUGIN).new $(PLUGIN); }
	@$(or $(SUNBEAM_PYTHON),$(PY)) -c "from importlib.metadata import version; print(version('mitsuba'))" > target/mitsuba/version
	@echo "plugin: $(CURDIR)/$(PLUGIN)"

# The command, target/release/sunbeam, and its window beside it.
tool:
	$(CARGO) build --release -p sunbeam-cli -p sunbeam-window

# The C interface, as others link it.
library:
	$(CARGO) build --release -p sunbeam-c
	@mkdir -p $(LIBRARY)/lib $(LIBRARY)/include
	@cp target/release/libsunbeam_c.so $(LIBRARY)/lib/libsunbeam.so
	@cp target/release/libsunbeam_c.a $(LIBRARY)/lib/libsunbeam.a
	@cp crates/c_abi/include/sunbeam.h $(LIBRARY)/include/
	@mkdir -p $(LIBRARY)/lib/pkgconfig $(LIBRARY)/lib/cmake/sunbeam
	@cp crates/c_abi/package/sunbeam.pc $(LIBRARY)/lib/pkgconfig/
	@cp crates/c_abi/package/*.cmake $(LIBRARY)/lib/cmake/sunbeam/
	@echo "library: $(CURDIR)/$(LIBRARY)"

# crates/c_abi/include/sunbeam.h from crates/c_abi/src/.
header:
	SUNBEAM_WRITE_HEADER=1 $(CARGO) test --release -p sunbeam-c --test header

# SUNBEAM_REQUIRE names parts of the machine without which a test fails instead of being skipped: tests/needs.txt.
test: new-skips test-rust test-python test-web
	@if [ -s $(SKIPS) ]; then printf '\nNot tested on this machine:\n'; sort -u $(SKIPS); fi

new-skips:
	@mkdir -p $(dir $(SKIPS)); : > $(SKIPS)

# The release profile serves everything, so that dependencies are built once. The tests of the plugin's Rust half load
# the libraries of the wheels.
test-rust: $(READY)
	LD_LIBRARY_PATH=$$($(PY) -c "import importlib.util as u; print(':'.join(u.find_spec(n).submodule_search_locations[0] for n in ('drjit', 'mitsuba')))") \
		$(CARGO) test --release --workspace --no-fail-fast

test-python: plugin library tool $(FORMATS)
	$(CARGO) build --release -p sunbeam --examples
	$(PY) -m pytest -n 2 --dist loadfile

# The plugin against each release of Mitsuba that it can be compiled for, or those named in RELEASES; and a wheel that
# holds a plugin for each, in out/wheel.
test-versions: $(READY)
	$(PY) scripts/versions.py test $(RELEASES)

wheel: $(READY)
	$(PY) scripts/versions.py build
	SUNBEAM_ALL_RELEASES=1 $(PY) -m pip wheel --quiet --no-build-isolation --no-deps --wheel-dir out/wheel .

lint: $(READY)
	$(CARGO) fmt --check
	$(CARGO) clippy --release --workspace --all-targets -- -D warnings
	$(CARGO) clippy --release -p sunbeam --no-default-features -- -D warnings
	$(PY) scripts/check_workspace.py
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy
	.venv/bin/clang-format --dry-run -Werror cpp_shim/*.cpp cpp_shim/*.h

format: $(READY)
	$(CARGO) fmt
	.venv/bin/ruff check --fix
	.venv/bin/ruff format
	.venv/bin/clang-format -i cpp_shim/*.cpp cpp_shim/*.h

crosscheck: plugin tool
	$(PY) -m mitsuba_scenes.crosscheck

# The window takes minutes more to build, and is not needed here.
demo: plugin
	$(CARGO) build --release -p sunbeam-cli
	$(PY) -m mitsuba_scenes.demo

scenes: plugin
	$(CARGO) build --release -p sunbeam-cli
	$(PY) -m mitsuba_scenes.files

# What the plugin costs in Mitsuba beside roughconductor, what the methods cost and how far off they are, how evenly the
# sampler weighs, and the C ABI's throughput; about ten minutes. `make figures` writes the same into pages.
bench: plugin library tool
	@mkdir -p out/bench
	$(PY) benches/mitsuba_cost.py --json out/bench/mitsuba.json
	target/release/sunbeam bench --what methods --json out/bench/methods.json --plot out/bench/methods.svg
	target/release/sunbeam bench --what sampler --json out/bench/sampler.json
	$(CC) -std=c11 -O2 -I $(LIBRARY)/include benches/batch.c -o $(LIBRARY)/batch -L $(LIBRARY)/lib -lsunbeam \
		-Wl,-rpath,$(CURDIR)/$(LIBRARY)/lib -lpthread -lm
	$(LIBRARY)/batch | tee out/bench/batch.json

# Where nvidia-smi finds a card: the CUDA variants and the realtime renderer on it, in at most eight minutes. Elsewhere the
# same code with LLVM and the software adapter, as tests run it.
bench-gpu: plugin
	$(CARGO) build --release -p sunbeam-cli
	$(PY) -m benches.gpu $(PARTS)

# The parts of pages named in PAGES, or all.
figures: plugin library tool
	$(if $(filter validity,$(or $(PAGES),validity)),$(PY) -m pip install --quiet -r requirements-validity.lock)
	$(PY) -m docs.figures $(PAGES)

# The site of docs/. Warnings are errors: what they tell of is a page that nobody finds, or a link that leads nowhere.
docs: $(READY)
	$(PY) -m sphinx -W --keep-going -q -b html docs target/docs
	@echo "site: $(CURDIR)/target/docs/index.html"

# The Rust API, target/doc/sunbeam/index.html.
api-docs:
	$(CARGO) doc --no-deps -p sunbeam -p sunbeam-realtime

# The page for browsers, static files in target/web. Servers of every kind will do; this one is for trying.
web:
	scripts/web.sh

web-serve: web
	@echo "http://localhost:$(or $(PORT),8000)/"
	$(PYTHON) -m http.server --bind localhost --directory target/web $(or $(PORT),8000)

# In headless Chromium, beside what the native renderer draws of the same settings. Where that is missing, one line says so.
test-web: $(READY) tool
	PY=$(PY) scripts/test_web.sh

bench-web: $(READY) web
	$(PY) crates/web/tests/bench_web.py

clean:
	rm -rf target out
