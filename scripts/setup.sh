#!/usr/bin/env bash
# Makes .venv with the packages of requirements.lock, and checks the system for the plugin's requirements.
# Missing Debian packages are installed where root is available, and named elsewhere.
set -euo pipefail
cd "$(dirname "$0")/.."
PYTHON="${PYTHON:-python3}"

say() { printf '[setup] %s\n' "$*"; }
fail() {
    printf '[setup] error: %s\n' "$*" >&2
    exit 1
}

# as_root COMMAND…: runs it as root; fails where that needs a password.
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo -n "$@"
    else
        return 1
    fi
}

# Whether this run has refreshed the package lists: empty or 1.
lists_fresh=
# try_install WHAT PACKAGE…: installs the first package that this release of Debian or Ubuntu has.
try_install() {
    local what="$1" package
    shift
    command -v apt-get >/dev/null && as_root true || return 1
    if [ -z "$lists_fresh" ]; then
        as_root apt-get update -qq || say "the package lists could not be refreshed; going on with the old ones"
        lists_fresh=1
    fi
    for package in "$@"; do
        if apt-cache show "$package" >/dev/null 2>&1; then
            say "installing the Debian package $package ($what)"
            as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$package" &&
                return
        fi
    done
    return 1
}

# install_one WHAT PACKAGE…: installs a requirement, or ends with an error.
install_one() {
    try_install "$@" ||
        fail "$1 is missing. As root: apt-get install $2 (or its equivalent elsewhere), then try again"
}

# want WHAT PACKAGE: installs an optional part of the GPU renderer and its window, or prints a note.
want() {
    try_install "$@" || say "note: $1 is missing (as root: apt-get install $2); its tests are skipped without"
}

say "1/5 compilers"
command -v cargo >/dev/null || fail "cargo is missing. See https://rustup.rs"
command -v "${CXX:-c++}" >/dev/null || install_one "a C++17 compiler" g++
for component in rustfmt clippy; do
    # Cargo's command of the component rustfmt is `cargo fmt`.
    if ! cargo "${component/rustfmt/fmt}" --version >/dev/null 2>&1; then
        rustup component add "$component" 2>/dev/null ||
            say "note: $component is missing, which \`make lint\` needs (rustup component add $component)"
    fi
done

say "2/5 Python"
command -v "$PYTHON" >/dev/null || fail "$PYTHON is missing; set PYTHON to an interpreter of version 3.9 or newer"
"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 9))' ||
    fail "$PYTHON is $("$PYTHON" --version 2>&1), but 3.9 or newer is needed; set PYTHON to another interpreter"
if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    "$PYTHON" -c 'import ensurepip, venv' 2>/dev/null || install_one "Python's venv module" python3-venv
    "$PYTHON" -m venv --clear .venv
fi

say "3/5 Python packages (about 200 MB the first time)"
# Modules are compiled at their first import; most are never imported.
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --only-binary=:all: \
    -r requirements.lock

# LLVM 15 loads but fails to generate code, so the check runs a kernel.
say "4/5 LLVM"
llvm_works() {
    .venv/bin/python -c '
import drjit as dr
from drjit.llvm import Float
a, b = dr.opaque(Float, 1, 4), dr.opaque(Float, 2, 4)
assert dr.all(dr.minimum(a, b) == a) and dr.all(dr.maximum(a, b) == b)' >/dev/null 2>&1
}
if ! llvm_works; then
    install_one "an LLVM of version 16 or newer as a library" libllvm19 libllvm20 libllvm18 libllvm17 libllvm16
    llvm_works || fail "Dr.Jit cannot use the LLVM it finds; set DRJIT_LIBLLVM_PATH to a libLLVM of version 16 or newer"
fi

# The software adapter for tests, the libraries that the window loads when it opens, and its test's display and input.
say "5/5 the GPU renderer and its window"
if [ "$(uname)" = Linux ]; then
    has_library() { .venv/bin/python -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1])' "$1" 2>/dev/null; }
    has_library libvulkan.so.1 || want "the Vulkan loader" libvulkan1
    compgen -G '/usr/share/vulkan/icd.d/lvp_icd*.json' >/dev/null ||
        want "Mesa's software Vulkan driver" mesa-vulkan-drivers
    has_library libX11-xcb.so.1 || want "the X client library" libx11-xcb1
    has_library libXcursor.so.1 || want "the X library for cursors" libxcursor1
    has_library libXi.so.6 || want "the X library for input" libxi6
    has_library libxkbcommon-x11.so.0 || want "the X library for keyboards" libxkbcommon-x11-0
    command -v Xvfb >/dev/null || want "an X server without a screen" xvfb
    command -v xdotool >/dev/null || want "a tool for input to X windows" xdotool
fi

# The Makefile runs this script again when requirements.lock or the script is newer than this file.
touch .venv/.ready
say "ready"
