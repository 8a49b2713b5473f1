"""The C interface: the programs in tests/c_abi/ run, also under AddressSanitizer and Valgrind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from needs import require_program

REPOSITORY = Path(__file__).resolve().parent.parent
LIBRARY = REPOSITORY / "target" / "c_abi"
SOURCES = REPOSITORY / "tests" / "c_abi"
PROGRAMS = ["example.c", "example.cpp", "threads.c"]
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
# System libraries of a Rust static library, by `rustc --print native-static-libs`.
SYSTEM = ["-lgcc_s", "-lutil", "-lrt", "-lpthread", "-lm", "-ldl", "-lc"]


def compiler(source):
    language = {".c": (os.environ.get("CC", "cc"), "-std=c11"), ".cpp": (os.environ.get("CXX", "c++"), "-std=c++17")}
    return language[Path(source).suffix]


def build(source, folder, *flags, static=False):
    """Compiles a program against the header and links it with the library."""
    name, standard = compiler(source)
    program = folder / source.replace(".", "-")
    library = (
        [str(LIBRARY / "lib" / "libsunbeam.a"), *SYSTEM]
        if static
        else ["-L", str(LIBRARY / "lib"), "-lsunbeam", f"-Wl,-rpath,{LIBRARY / 'lib'}", "-lpthread", "-lm"]
    )
    words = [name, standard, "-O1", "-g", *WARNINGS, *flags, "-I", str(LIBRARY / "include"), str(SOURCES / source)]
    done = subprocess.run([*words, "-o", str(program), *library], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def run(*words):
    """Runs a program without the cache of tables, so that it builds them."""
    environment = {**os.environ, "SUNBEAM_CACHE": "off"}
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, env=environment, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module", autouse=True)
def library():
    if not (LIBRARY / "lib" / "libsunbeam.so").exists():
        pytest.exit("the library is not built: run `make library` first", returncode=2)


@pytest.mark.parametrize("source", PROGRAMS)
@pytest.mark.parametrize("static", [False, True], ids=["shared", "static"])
def test_program_runs(source, static, tmp_path):
    run(build(source, tmp_path, static=static))


@pytest.mark.parametrize("source", PROGRAMS)
def test_program_runs_under_address_sanitizer(source, tmp_path):
    """Checks accesses of the program, allocations of the library, and undefined behaviour."""
    flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]
    run(build(source, tmp_path, *flags))


@pytest.mark.parametrize("source", PROGRAMS)
def test_program_runs_under_valgrind(source, tmp_path):
    """Checks the library's own accesses, and memory that nothing points to any more.

    The threads that build tables live until the program ends, so their memory is no leak.
    """
    require_program("valgrind", "valgrind")
    program = build(source, tmp_path)
    run("valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=definite", program)


def test_library_exports_the_abi_alone():
    """Exported symbols of dependencies could collide with a program's own."""
    listing = subprocess.run(
        ["nm", "--dynamic", "--defined-only", "--format=posix", str(LIBRARY / "lib" / "libsunbeam.so")],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    names = {line.split()[0] for line in listing.splitlines()}
    declared = {word.split("(")[0].strip("*") for word in (LIBRARY / "include" / "sunbeam.h").read_text().split()}
    functions = {name for name in declared if name.startswith("sunbeam_") and name in names}
    assert names == functions
    assert len(functions) == 10


@pytest.mark.parametrize("static", [False, True], ids=["shared", "static"])
def test_pkg_config_says_how_to_link(static, tmp_path):
    require_program("pkg-config", "pkg-config")
    words = ["pkg-config", "--cflags", "--libs", *(["--static"] if static else []), "sunbeam >= 0.1"]
    environment = {**os.environ, "PKG_CONFIG_PATH": str(LIBRARY / "lib" / "pkgconfig")}
    flags = subprocess.run(words, capture_output=True, text=True, check=True, env=environment).stdout.split()
    assert set(SYSTEM) - {"-lc"} <= set(flags) or not static
    name, standard = compiler("example.c")
    program = tmp_path / "example"
    words = [name, standard, str(SOURCES / "example.c"), "-o", str(program), *flags, "-lm"]
    subprocess.run([*words, f"-Wl,-rpath,{LIBRARY / 'lib'}"], check=True)
    run(program)


CMAKE_PROJECT = """
cmake_minimum_required(VERSION 3.15)
project(user C)
find_package(sunbeam 0.1 REQUIRED CONFIG)
foreach(library sunbeam sunbeam_static)
    add_executable(with_${library} %s)
    set_target_properties(with_${library} PROPERTIES C_STANDARD 11)
    target_link_libraries(with_${library} PRIVATE sunbeam::${library} m)
endforeach()
"""


def test_cmake_finds_the_library(tmp_path):
    cmake = Path(sys.executable).with_name("cmake")
    (tmp_path / "CMakeLists.txt").write_text(CMAKE_PROJECT % (SOURCES / "example.c"))
    configure = [cmake, "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={LIBRARY}"]
    for words in ([*configure, "-G", "Unix Makefiles"], [cmake, "--build", tmp_path / "build"]):
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    for library in ("sunbeam", "sunbeam_static"):
        run(tmp_path / "build" / f"with_{library}")


def test_cmake_refuses_another_minor_version(tmp_path):
    cmake = Path(sys.executable).with_name("cmake")
    (tmp_path / "CMakeLists.txt").write_text((CMAKE_PROJECT % "none.c").replace("sunbeam 0.1", "sunbeam 0.2"))
    words = [cmake, "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={LIBRARY}"]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode != 0
    assert 'compatible with requested version "0.2"' in " ".join(done.stderr.split())
