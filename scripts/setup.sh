#!/usr/bin/env bash
# Makes .venv with exactly what requirements.lock says, and sees that the system has what the plugin needs.
# Debian packages are installed only where they are missing and root is available; otherwise they are named.
set -euo pipefail
cd "$(dirname "$0")/.."
PYTHON="${PYTHON:-python3}"

say() { printf '[setup] %s\n' "$*"; }
fail() {
    printf '[setup] error: %s\n' "$*" >&2
    exit 1
}

# as_root COMMAND…: fails where there is no way to be root without being asked for a password.
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo -n "$@"
    else
        return 1
    fi
}

# install_one WHAT PACKAGE…: installs the first of the packages that this release of Debian or Ubuntu has.
install_one() {
    local what="$1" package
    shift
    if command -v apt-get >/dev/null && as_root true; then
        as_root apt-get update -qq || say "the package lists could not be refreshed; going on with the old ones"
        for package in "$@"; do
            if apt-cache show "$package" >/dev/null 2>&1; then
                say "installing the Debian package $package ($what)"
                as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$package" &&
                    return
            fi
        done
    fi
    fail "$what is missing. As root: apt-get install $1 (or its equivalent elsewhere), then try again"
}

say "1/4 compilers"
command -v cargo >/dev/null || fail "cargo is missing. See https://rustup.rs"
command -v "${CXX:-c++}" >/dev/null || install_one "a C++17 compiler" g++
for component in rustfmt clippy; do
    if ! cargo "${component/rustfmt/fmt}" --version >/dev/null 2>&1; then
        rustup component add "$component" 2>/dev/null ||
            say "note: $component is missing, which \`make lint\` needs (rustup component add $component)"
    fi
done

say "2/4 Python"
command -v "$PYTHON" >/dev/null || fail "$PYTHON is missing; set PYTHON to an interpreter of version 3.9 or newer"
"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 9))' ||
    fail "$PYTHON is $("$PYTHON" --version 2>&1), but 3.9 or newer is needed; set PYTHON to another interpreter"
if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    "$PYTHON" -c 'import ensurepip, venv' 2>/dev/null || install_one "Python's venv module" python3-venv
    "$PYTHON" -m venv --clear .venv
fi

say "3/4 Python packages (about 200 MB the first time)"
.venv/bin/python -m pip install --quiet --disable-pip-version-check --only-binary=:all: -r requirements.lock

# LLVM 15 loads and then fails in code generation, so this asks for code and not for a file.
say "4/4 LLVM"
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

touch .venv/.ready
say "ready"
