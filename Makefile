# Targets build everything from a fresh clone. Needs Rust, Python >= 3.9 and a C++17 compiler.

PYTHON ?= python3
PY     := .venv/bin/python
# Marker files: the packages of requirements.lock, and those of requirements-formats.lock, are in .venv.
READY  := .venv/.ready
FORMATS := .venv/.formats
# One line for each skipped test of the last `make test`.
SKIPS := target/skips.txt
PLUGIN := target/mitsuba/plugins/diffraction.so
LIBRARY := target/c_abi
CARGO  := cargo
# Packages that need no Python, built while pip downloads.
EARLY  := -p sunbeam-fourier -p sunbeam-height-field -p sunbeam-rigorous -p sunbeam-unify
EARLY  += --features sunbeam-height-field/files
# Fixed: Mitsuba's file resolver and the documentation name this folder.
export CARGO_TARGET_DIR := target
export SUNBEAM_SKIPS := $(CURDIR)/$(SKIPS)

# With this variable, which images of containers often set, Python keeps no compiled modules. pip does not compile them
# either (scripts/setup.sh), so each of the tests' hundreds of interpreters would.
unexport PYTHONDONTWRITEBYTECODE

# Parallel builds would wait for each other's locks.
.NOTPARALLEL:
.PHONY: all setup plugin tool library header check test new-skips test-rust test-python test-versions wheel lint format
.PHONY: demo scenes crosscheck bench bench-gpu figures docs api-docs web web-serve test-web bench-web clean help

all: plugin

help:
	@echo "make plugin         build $(PLUGIN)"
	@echo "make tool           build target/release/sunbeam and its window"
	@echo "make library        build the C library and its header, $(LIBRARY)/"
	@echo "make demo           render the snake and compare the renderers, results in out/"
	@echo "make scenes         write scenes for the mitsuba command into out/scenes/"
	@echo "make crosscheck     compare the renderers, results in out/crosscheck/"
	@echo
	@echo "make check          run the fast tests, those of the library and the plugin's optics"
	@echo "make test           run every test"
	@echo "make test-web       run the tests of the page in headless Chromium, part of make test"
	@echo "make test-versions  test the plugin with each release of Mitsuba that it can be compiled for"
	@echo "make lint           check formatting and lints; make format applies the formatting"
	@echo
	@echo "make docs           build the documentation, target/docs/index.html; make api-docs the Rust API's"
	@echo "make figures        measure and write the pages of figures in docs/; PAGES=brdf-maps selects pages"
	@echo "make web            build the page for browsers, target/web/; make web-serve serves it on this machine"
	@echo "make wheel          build the Python package with a plugin for each release of Mitsuba, out/wheel/"
	@echo
	@echo "make bench          time the plugin, the methods, the sampler and the C library, results in out/bench/"
	@echo "make bench-gpu      check and time a machine with an NVIDIA card, results in docs/data/gpu.json; elsewhere a"
	@echo "                    dry run. PARTS selects parts: .venv/bin/python -m benches.gpu --list"
	@echo "make bench-web      time the page in headless Chromium"
	@echo "make clean          remove target/ and out/"

setup: $(READY)

# Errors of the packages EARLY are hidden here, and appear again in the builds that follow.
$(READY): requirements.lock scripts/setup.sh
	@$(CARGO) build --release --quiet $(EARLY) >/dev/null 2>&1 & compiling=$$!; \
	PYTHON="$(PYTHON)" scripts/setup.sh; ready=$$?; \
	[ $$ready = 0 ] || kill $$compiling 2>/dev/null; wait $$compiling; exit $$ready

# The library SurfaceTopography for tests of instruments' files, 62 MB of wheels.
$(FORMATS): requirements-formats.lock $(READY)
	$(PY) -m pip install --quiet --disable-pip-version-check --no-compile --only-binary=:all: -r $<
	@touch $@

# The plugin's copy is replaced atomically, since a running Mitsuba may have it mapped.
plugin: $(READY)
	$(CARGO) build --release -p sunbeam-mitsuba
	@mkdir -p $(dir $(PLUGIN))
	@cmp -s target/release/libsunbeam_mitsuba.so $(PLUGIN) || \
		{ cp target/release/libsunbeam_mitsuba.so $(PLUGIN).new && mv $(PLUGIN).new $(PLUGIN); }
	@$(or $(SUNBEAM_PYTHON),$(PY)) -c "from importlib.metadata import version; print(version('mitsuba'))" \
		> target/mitsuba/version
	@echo "plugin: $(CURDIR)/$(PLUGIN)"

# The command target/release/sunbeam, and its window sunbeam-view.
tool:
	$(CARGO) build --release -p sunbeam-cli -p sunbeam-window

# The C interface, in the layout of an installation.
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

# Writes crates/c_abi/include/sunbeam.h from crates/c_abi/src/.
header:
	SUNBEAM_WRITE_HEADER=1 $(CARGO) test --release -p sunbeam-c --test header

# Names of the Python tests that compare the plugin with the library. `make check` runs them and the library's own.
CHECKED := chi2 energy plugin_bsdf small_slope twins
check: plugin
	$(CARGO) test --release -p sunbeam -p sunbeam-fourier -p sunbeam-height-field -p sunbeam-rigorous --lib --test core
	$(PY) -m pytest -q -n 2 --dist loadfile $(CHECKED:%=tests/test_%.py)

# SUNBEAM_REQUIRE names parts of the machine without which a test fails instead of being skipped: tests/needs.txt.
test: new-skips test-rust test-python test-web
	@if [ -s $(SKIPS) ]; then printf '\nNot tested on this machine:\n'; sort -u $(SKIPS); fi

new-skips:
	@mkdir -p $(dir $(SKIPS)); : > $(SKIPS)

# Tests use the release profile, too, so that dependencies are built once. The tests of the plugin's Rust half load the
# libraries of the wheels.
WHEELS = $(PY) -c "from importlib.util import find_spec as find; \
	print(':'.join(find(name).submodule_search_locations[0] for name in ('drjit', 'mitsuba')))"
test-rust: $(READY)
	LD_LIBRARY_PATH=$$($(WHEELS)) $(CARGO) test --release --workspace --no-fail-fast

test-python: plugin library tool $(FORMATS)
	$(CARGO) build --release -p sunbeam --examples
	$(PY) -m pytest -n 2 --dist loadfile

# RELEASES selects releases of Mitsuba; the default is all that the plugin can be compiled for.
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

# The window, which takes minutes to build, is not needed.
demo: plugin
	$(CARGO) build --release -p sunbeam-cli
	$(PY) -m mitsuba_scenes.demo

scenes: plugin
	$(CARGO) build --release -p sunbeam-cli
	$(PY) -m mitsuba_scenes.files

# Cost of the plugin beside roughconductor, cost and error of the methods, variance of the sampler's weights, and
# throughput of the C library; about ten minutes. `make figures` writes these numbers into pages.
bench: plugin library tool
	@mkdir -p out/bench
	$(PY) benches/mitsuba_cost.py --json out/bench/mitsuba.json
	target/release/sunbeam bench --what methods --json out/bench/methods.json --plot out/bench/methods.svg
	target/release/sunbeam bench --what sampler --json out/bench/sampler.json
	$(CC) -std=c11 -O2 -I $(LIBRARY)/include benches/batch.c -o $(LIBRARY)/batch -L $(LIBRARY)/lib -lsunbeam \
		-Wl,-rpath,$(CURDIR)/$(LIBRARY)/lib -lpthread -lm
	$(LIBRARY)/batch | tee out/bench/batch.json

# With an NVIDIA card: the CUDA variants and the realtime renderer, in at most eight minutes. Elsewhere: LLVM and the
# software adapter, as in the tests.
bench-gpu: plugin
	$(CARGO) build --release -p sunbeam-cli
	$(PY) -m benches.gpu $(PARTS)

# The parts of pages named in PAGES, or all. The part `validity` needs a third-party solver, which is installed first.
figures: plugin library tool
	$(if $(filter validity,$(or $(PAGES),validity)),$(PY) -m pip install --quiet -r requirements-validity.lock)
	$(PY) -m docs.figures $(PAGES)

# The site of docs/. Warnings are errors: they report unreachable pages and broken links.
docs: $(READY)
	$(PY) -m sphinx -W --keep-going -q -b html docs target/docs
	@echo "site: $(CURDIR)/target/docs/index.html"

# The Rust API, target/doc/sunbeam/index.html.
api-docs:
	$(CARGO) doc --no-deps -p sunbeam -p sunbeam-realtime

# The page for browsers, static files in target/web. `make web-serve` is a server for trying it.
web:
	scripts/web.sh

web-serve: web
	@echo "http://localhost:$(or $(PORT),8000)/"
	$(PYTHON) -m http.server --bind localhost --directory target/web $(or $(PORT),8000)

# In headless Chromium, against the native renderer's pictures.
test-web: $(READY) tool
	PY=$(PY) scripts/test_web.sh

bench-web: $(READY) web
	$(PY) crates/web/tests/bench_web.py

clean:
	rm -rf target out
