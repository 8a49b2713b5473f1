#!/usr/bin/env bash
# Builds the page into target/web: the library as WebAssembly, the JavaScript around it, the page's files, the examples.
# Called by `make web`; with --check it only finds or installs a compiler, or fails. With SUNBEAM_WEB_EXAMPLES set, the
# pictures of the examples are drawn again even if they exist.
#
# The compiler for WebAssembly is
# - rustup's, whose target is added where its servers are reached;
# - else Debian's, with the standard library built from its source. This takes an unstable option of Cargo, which
#   RUSTC_BOOTSTRAP allows.
set -euo pipefail
cd "$(dirname "$0")/.."

PAGE=target/web
TARGET=wasm32-unknown-unknown
DEBIAN="apt-get install rustc-web cargo-web rust-web-src"
# The folder of the measured scans; without it their examples are left out.
SCANS="${SUNBEAM_DATA:-../shared/data}/afm"
export CARGO_TARGET_DIR=target
# Every browser with WebGPU has 128-bit SIMD. wasm_js is the dependency getrandom's source of random numbers.
FLAGS='--cfg getrandom_backend="wasm_js" -C target-feature=+simd128'

say() { printf '[web] %s\n' "$*"; }
fail() {
    printf '[web] error: %s\n' "$*" >&2
    exit 1
}

# has_target RUSTC: whether this compiler has a standard library for TARGET.
has_target() { [ -d "$("$1" --print target-libdir --target "$TARGET" 2>/dev/null)" ]; }
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi; }

# find_target: sets the environment of a compiler for TARGET, and BUILD_STD where it must build the standard library.
find_target() {
    BUILD_STD=()
    CARGO="${CARGO:-cargo}"
    if has_target "${RUSTC:-rustc}"; then return; fi
    if command -v rustup >/dev/null && rustup target add "$TARGET" >/dev/null 2>&1 &&
        has_target "${RUSTC:-rustc}"; then return; fi
    say "rustup does not give the target $TARGET; trying Debian's compiler"
    if ! [ -e /usr/lib/rustlib/src/rust/library/std/Cargo.toml ] && ! [ -d /usr/src/rustc-web ]; then
        command -v apt-get >/dev/null && as_root apt-get install -y -qq --no-install-recommends \
            rustc-web cargo-web rust-web-src >/dev/null 2>&1 ||
            fail "Rust's target $TARGET is missing: rustup target add $TARGET, or as root $DEBIAN"
    fi
    [ -x /usr/bin/rustc ] && [ -x /usr/bin/cargo ] || fail "Debian's compiler is missing: $DEBIAN"
    local sysroot linker
    sysroot="$(rustc --print sysroot)"
    linker="$(find "$sysroot" /usr/lib/rustlib -name rust-lld -type f 2>/dev/null | head -n 1)"
    [ -n "$linker" ] || linker="$(command -v wasm-ld || true)"
    [ -n "$linker" ] ||
        fail "a linker for WebAssembly is missing: rust-lld of a Rust toolchain, or as root apt-get install lld"
    CARGO=/usr/bin/cargo
    export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$linker"
    BUILD_STD=(-Zbuild-std=std,panic_abort)
}

build_code() (
    find_target
    export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="$FLAGS"
    "$CARGO" rustc --locked --profile page -p sunbeam-web --lib --crate-type cdylib --target "$TARGET" "${BUILD_STD[@]}"
)

# The program sunbeam-bindgen, which writes the JavaScript around the code.
build_bindgen() {
    env -u RUSTC CARGO_TARGET_DIR=target/bindgen \
        cargo build --locked --release --manifest-path crates/web/bindgen/Cargo.toml
}

# The program page_twin, which draws the page's pictures natively: here those of the examples.
build_twin() {
    cargo build --release -p sunbeam-web --example page_twin
}

if [ "${1:-}" = --check ]; then
    find_target
    exit
fi

say "1/4 the code"
# Linking the code takes one core, so the other programs are compiled beside it, at low priority. The builds that follow
# repeat their errors.
(
    renice -n 19 "$BASHPID"
    build_bindgen
    build_twin
) >/dev/null 2>&1 &
others=$!
trap 'kill "$others" 2>/dev/null || true' EXIT
build_code
say "2/4 the JavaScript around it"
wait "$others" || true
build_bindgen
rm -rf "$PAGE.new"
mkdir -p "$PAGE.new/wasm"
target/bindgen/release/sunbeam-bindgen "target/$TARGET/page/sunbeam_web.wasm" "$PAGE.new/wasm"
say "3/4 the page"
cp -R crates/web/page/. "$PAGE.new/"
say "4/4 the examples"
if [ -d "$PAGE/examples" ] && [ -z "${SUNBEAM_WEB_EXAMPLES:-}" ] &&
    [ "$PAGE/examples/index.json" -nt crates/web/examples.json ]; then
    cp -R "$PAGE/examples" "$PAGE.new/examples"
else
    [ -d "$SCANS" ] || say "note: there is no folder $SCANS, see SUNBEAM_DATA: examples of scans are left out"
    build_twin
    target/release/examples/page_twin --examples crates/web/examples.json --scans "$SCANS" -o "$PAGE.new/examples"
fi
rm -rf "$PAGE"
mv "$PAGE.new" "$PAGE"
code_bytes="$(gzip -9 -c "$PAGE/wasm/sunbeam_web_bg.wasm" | wc -c)"
page_bytes="$(find "$PAGE" -type f ! -name '*.gsf' -exec gzip -9 -c {} + | wc -c)"
say "page: $PWD/$PAGE, $((page_bytes / 1000)) kB gzipped without scans, of which the code $((code_bytes / 1000)) kB"
