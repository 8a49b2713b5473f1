#!/usr/bin/env bash
# Builds the page and tests it in headless Chromium: `make test-web PY=…`. Where a browser or Rust's target for
# WebAssembly is missing, nothing is tested: a skip (tests/needs.py).
set -euo pipefail
cd "$(dirname "$0")/.."
PY="${PY:-.venv/bin/python}"

# not_tested NEED REASON: reports the skip and ends.
not_tested() {
    PYTHONPATH=tests exec "$PY" -c 'import needs, sys; needs.miss(sys.argv[1], "the page", sys.argv[2])' "$@"
}

# Both programs print the reason where they fail.
reason="$("$PY" crates/web/tests/browser.py)" || not_tested chromium "$reason"
reason="$(scripts/web.sh --check 2>&1)" || not_tested wasm "${reason##*error: }"
scripts/web.sh
cargo build --release -p sunbeam-web --example page_twin
exec "$PY" -m pytest -n 2 --dist worksteal crates/web/tests "$@"
