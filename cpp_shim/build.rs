//! Compiles the C++ half of the Mitsuba plugin against the headers and libraries that the PyPI wheels of Mitsuba and
//! Dr.Jit carry (docs/plugin-build.md).

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if let Err(reason) = build() {
        eprintln!("error: cannot build the Mitsuba plugin: {reason}");
        std::process::exit(1);
    }
}

/// A release of Mitsuba whose wheel the plugin can be compiled against. Layouts of Mitsuba's classes change between
/// releases, so versions are exact.
struct Release {
    /// Version of the package `mitsuba`.
    mitsuba: &'static str,
    /// Version of the package `drjit` that this Mitsuba requires.
    drjit: &'static str,
    /// Instruction set that the wheel was compiled for. With AVX, Dr.Jit's small arrays are SIMD registers, which
    /// changes layouts and the calling convention. A plugin for another instruction set loads and renders garbage.
    march: &'static str,
    /// Whether the wheel uses the `std::string` of C++11. Wheels for manylinux2014 use the older `std::string`.
    cxx11_strings: bool,
}

/// Supported releases, the newest first.
const RELEASES: [Release; 4] = [
    Release { mitsuba: "3.9.1", drjit: "1.5.0", march: "x86-64-v3", cxx11_strings: true },
    Release { mitsuba: "3.9.0", drjit: "1.4.0", march: "x86-64-v3", cxx11_strings: true },
    Release { mitsuba: "3.8.0", drjit: "1.3.1", march: "ivybridge", cxx11_strings: true },
    Release { mitsuba: "3.7.1", drjit: "1.2.0", march: "ivybridge", cxx11_strings: false },
];

/// Version of nanobind that requirements.lock installs. The plugin uses only its reference counter, which has been the
/// same since 2.0.
const NANOBIND: &str = "2.14.0";

/// Python packages whose headers the plugin includes.
const PACKAGES: [&str; 3] = ["mitsuba", "drjit", "nanobind"];

/// C++ files to compile, in this folder.
const SOURCES: [&str; 9] = [
    "checks.cpp",
    "diffraction.cpp",
    "jit.cpp",
    "jit_tests.cpp",
    "log.cpp",
    "parameters.cpp",
    "variants_cuda.cpp",
    "variants_llvm.cpp",
    "variants_scalar.cpp",
];

/// Rust files with a cxx bridge.
const BRIDGES: [&str; 4] = ["src/bridge.rs", "src/jit.rs", "src/jit_tests.rs", "src/log.rs"];

/// Compiler flags, beside the instruction set of the release.
const FLAGS: [&str; 4] = [
    // Required by Dr.Jit's headers: its CMake targets set it for everything that includes them.
    "-fno-strict-aliasing",
    // Lets square roots compile to one instruction.
    "-fno-math-errno",
    // Keep the plugin's symbols out of the process's symbol table, where another library could replace them.
    "-fvisibility=hidden",
    "-fvisibility-inlines-hidden",
];

/// Macros for the options that the wheels were built with. Mitsuba's classes have members that depend on them.
const OPTIONS: [&str; 4] = ["MI_ENABLE_CUDA", "MI_ENABLE_LLVM", "MI_ENABLE_EMBREE", "MI_ENABLE_AUTODIFF"];

fn build() -> Result<(), String> {
    watch_sources()?;
    let (os, arch) = (env::var("CARGO_CFG_TARGET_OS"), env::var("CARGO_CFG_TARGET_ARCH"));
    if os.as_deref() != Ok("linux") || arch.as_deref() != Ok("x86_64") {
        return Err("the wheel's calling convention is known for Linux on x86-64 only".into());
    }
    let wheels = find_wheels()?;
    compile(&wheels)?;
    link(&wheels);
    Ok(())
}

/// Makes Cargo run this script again after a change of a C++ file, a bridge, or the choice of the interpreter.
fn watch_sources() -> Result<(), String> {
    // Each C++ file of this folder is watched, not the folder: otherwise a Rust file changed in `src/` would recompile
    // the C++.
    let files = fs::read_dir(".").map_err(|error| error.to_string())?;
    let is_cpp = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "cpp" || extension == "h");
    for file in files.flatten().map(|entry| entry.path()).filter(is_cpp) {
        println!("cargo:rerun-if-changed={}", file.display());
    }
    for bridge in BRIDGES {
        println!("cargo:rerun-if-changed={bridge}");
    }
    println!("cargo:rerun-if-env-changed=SUNBEAM_PYTHON");
    Ok(())
}

/// Compiles [`SOURCES`] and the C++ that cxx generates for [`BRIDGES`] into a static library.
fn compile(wheels: &Wheels) -> Result<(), String> {
    let Wheels { release, mitsuba, drjit, nanobind } = wheels;
    cxx_build::CFG.include_prefix = "sunbeam_mitsuba";
    let mut shim = cxx_build::bridges(BRIDGES);
    // Without assertions (`NDEBUG`) in every profile of Cargo, as a release build of Mitsuba.
    shim.std("c++17").opt_level(2).debug(false).warnings(true).define("NDEBUG", None);
    shim.includes(["."]);
    // `-isystem` suppresses warnings about these headers.
    for dir in [
        mitsuba.join("include"),
        drjit.join("include"),
        nanobind.join("include"),
        nanobind.join("ext/robin_map/include"),
    ] {
        shim.flag("-isystem").flag(&dir);
    }
    for flag in FLAGS {
        shim.flag(flag);
    }
    shim.flag(format!("-march={}", release.march));
    shim.define("_GLIBCXX_USE_CXX11_ABI", if release.cxx11_strings { "1" } else { "0" });
    // `checks.cpp` compares these two with the headers and the compiler's own macros.
    shim.define("SUNBEAM_MITSUBA", format!("\"{}\"", release.mitsuba).as_str());
    shim.define("SUNBEAM_AVX2", if release.march == "x86-64-v3" { "1" } else { "0" });
    for option in OPTIONS {
        shim.define(option, "1");
    }
    for source in SOURCES {
        shim.file(source);
    }
    shim.try_compile("sunbeam_mitsuba").map_err(|error| error.to_string())
}

/// Links the plugin against the wheels' libraries.
fn link(wheels: &Wheels) {
    let Wheels { mitsuba, drjit, .. } = wheels;
    for (dir, library) in [(mitsuba, "mitsuba"), (drjit, "drjit-core"), (drjit, "drjit-extra")] {
        println!("cargo:rustc-link-search=native={}", dir.display());
        println!("cargo:rustc-link-lib=dylib={library}");
    }
    // Mitsuba unloads plugins at exit, when the plugin's threads may still run. With this flag the code stays loaded.
    println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    // Another release of Mitsuba may lack functions that the plugin calls. Lazy binding looks them up at their first
    // call, so the plugin loads and its version check reports the mismatch.
    println!("cargo:rustc-cdylib-link-arg=-Wl,-z,lazy");
}

/// The installed release and the folders of its packages.
struct Wheels {
    release: &'static Release,
    mitsuba: PathBuf,
    drjit: PathBuf,
    nanobind: PathBuf,
}

/// Finds the packages of the interpreter and checks their versions.
fn find_wheels() -> Result<Wheels, String> {
    let python = find_python();
    // A bare `python3` is no path to a file, so Cargo then runs this script in every build.
    println!("cargo:rerun-if-changed={}", python.display());
    // Prints one line for each of PACKAGES: version, tab, folder. A missing package has the version "none" and no
    // folder.
    let script = "import importlib.metadata as m, sys\n\
                  for name in sys.argv[1:]:\n\
                  \x20   try:\n\
                  \x20       d = m.distribution(name); print(d.version, d.locate_file(name), sep='\\t')\n\
                  \x20   except m.PackageNotFoundError:\n\
                  \x20       print('none', '', sep='\\t')\n";
    let output = Command::new(&python)
        .args(["-c", script])
        .args(PACKAGES)
        .output()
        .map_err(|error| format!("{} does not run: {error}", python.display()))?;
    if !output.status.success() {
        return Err(format!("{} failed: {}", python.display(), String::from_utf8_lossy(&output.stderr).trim()));
    }
    let stdout = String::from_utf8_lossy(&output.stdout);
    let found: Vec<(&str, &str)> = stdout.lines().filter_map(|line| line.split_once('\t')).collect();
    let [(mitsuba, mitsuba_folder), (drjit, drjit_folder), (nanobind, nanobind_folder)] = found[..] else {
        return Err(format!("{} did not print the versions of its packages", python.display()));
    };
    let mismatch = |name: &str, wanted: &str, installed: &str| {
        format!(
            "it needs {name} {wanted} in {}, where there is {installed}. Run `make plugin`, which installs \
             requirements.lock into .venv, or name an interpreter that has it in SUNBEAM_PYTHON",
            python.display()
        )
    };
    let accepted = RELEASES.each_ref().map(|release| release.mitsuba).join(" or ");
    let release = RELEASES
        .iter()
        .find(|release| release.mitsuba == mitsuba)
        .ok_or_else(|| mismatch("mitsuba", &accepted, mitsuba))?;
    for (name, wanted, installed) in [("drjit", release.drjit, drjit), ("nanobind", NANOBIND, nanobind)] {
        if wanted != installed {
            return Err(mismatch(name, wanted, installed));
        }
    }
    // pip replaces these files when it installs another version.
    for folder in [mitsuba_folder, drjit_folder, nanobind_folder] {
        println!("cargo:rerun-if-changed={folder}/__init__.py");
    }
    Ok(Wheels { release, mitsuba: mitsuba_folder.into(), drjit: drjit_folder.into(), nanobind: nanobind_folder.into() })
}

/// The interpreter in which the packages are looked up: that of `SUNBEAM_PYTHON`, of the checkout's `.venv`, or
/// `python3` of the PATH.
fn find_python() -> PathBuf {
    if let Some(python) = env::var_os("SUNBEAM_PYTHON") {
        return python.into();
    }
    let venv = Path::new(&env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("../.venv/bin/python");
    if venv.exists() { venv } else { "python3".into() }
}
