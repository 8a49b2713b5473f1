#!/usr/bin/env bash
# Builds the page and tests it in headless Chromium: `make test-web PY=…`. Where a browser or Rust's target for WebAssembly
# is missing, nothing is tested, which one line says, with the way to get it.
set -euo pipefail
cd "$(dirname "$0")/.."
PY="${PY:-.venv/bin/python}"

not_tested() {
    printf '\n*** THE PAGE WAS NOT TESTED IN A BROWSER: %s ***\n\n' "$*" >&2
    exit 0
}

lacking="$("$PY" crates/web/tests/browser.py)" || not_tested "$lacking"
said="$(scripts/web.sh --check 2>&1)" || not_tested "${said##*error: }"
scripts/web.sh
cargo build --release -p sunbeam-web --example page_twin
exec "$PY" -m pytest -n 2 --dist worksteal crates/web/tests "$@"
