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
    mitsuba: &'static str,
    drjit: &'static str,
    /// Instruction set of the wheel. Dr.Jit turns small arrays into SIMD registers where it allows them, which changes
    /// layouts and the calling convention: without the wheel's `-march` the plugin loads and renders garbage.
    march: &'static str,
    /// Whether the wheel uses the `std::string` of C++11; wheels for manylinux2014 use the older one.
    cxx11_strings: bool,
}

/// Supported releases, the newest first.
const RELEASES: [Release; 4] = [
    Release { mitsuba: "3.9.1", drjit: "1.5.0", march: "x86-64-v3", cxx11_strings: true },
    Release { mitsuba: "3.9.0", drjit: "1.4.0", march: "x86-64-v3", cxx11_strings: true },
    Release { mitsuba: "3.8.0", drjit: "1.3.1", march: "ivybridge", cxx11_strings: true },
    Release { mitsuba: "3.7.1", drjit: "1.2.0", march: "ivybridge", cxx11_strings: false },
];

/// Version of nanobind. The plugin uses its reference counter alone, which has not changed since 2.0.
const NANOBIND: &str = "2.14.0";

const PACKAGES: [&str; 3] = ["mitsuba", "drjit", "nanobind"];

const SOURCES: [&str; 9] = [
    "checks.cpp",
    "diffraction.cpp",
    "jit.cpp",
    "jit_tests.cpp",
    "parameters.cpp",
    "progress.cpp",
    "variants_cuda.cpp",
    "variants_llvm.cpp",
    "variants_scalar.cpp",
];

/// Rust files with a cxx bridge.
const BRIDGES: [&str; 4] = ["src/bridge.rs", "src/jit.rs", "src/jit_tests.rs", "src/log.rs"];

const FLAGS: [&str; 4] =
    ["-fno-strict-aliasing", "-fno-math-errno", "-fvisibility=hidden", "-fvisibility-inlines-hidden"];

/// Backends that the wheel was built with; they add members to its classes.
const BACKENDS: [&str; 4] = ["MI_ENABLE_CUDA", "MI_ENABLE_LLVM", "MI_ENABLE_EMBREE", "MI_ENABLE_AUTODIFF"];

fn build() -> Result<(), String> {
    // Not the folder: Cargo would take changes of every Rust file in `src/` for changes of the C++.
    let sources = fs::read_dir(".").map_err(|error| error.to_string())?;
    let is_cpp = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "cpp" || extension == "h");
    for source in sources.flatten().map(|entry| entry.path()).filter(is_cpp) {
        println!("cargo:rerun-if-changed={}", source.display());
    }
    for bridge in BRIDGES {
        println!("cargo:rerun-if-changed={bridge}");
    }
    println!("cargo:rerun-if-env-changed=SUNBEAM_PYTHON");
    let (os, arch) = (env::var("CARGO_CFG_TARGET_OS"), env::var("CARGO_CFG_TARGET_ARCH"));
    if os.as_deref() != Ok("linux") || arch.as_deref() != Ok("x86_64") {
        return Err("the wheel's calling convention is known for Linux on x86-64 only".into());
    }
    let (release, [mitsuba, drjit, nanobind]) = find_wheels()?;

    cxx_build::CFG.include_prefix = "sunbeam_mitsuba";
    let mut shim = cxx_build::bridges(BRIDGES);
    shim.std("c++17").opt_level(2).debug(false).warnings(true).define("NDEBUG", None);
    shim.includes(["."]);
    // System headers, whose warnings the compiler leaves out.
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
    shim.define("SUNBEAM_MITSUBA", format!("\"{}\"", release.mitsuba).as_str());
    shim.define("SUNBEAM_AVX2", if release.march == "x86-64-v3" { "1" } else { "0" });
    for backend in BACKENDS {
        shim.define(backend, "1");
    }
    for source in SOURCES {
        shim.file(source);
    }
    shim.try_compile("sunbeam_mitsuba").map_err(|error| error.to_string())?;

    for (dir, library) in [(&mitsuba, "mitsuba"), (&drjit, "drjit-core"), (&drjit, "drjit-extra")] {
        println!("cargo:rustc-link-search=native={}", dir.display());
        println!("cargo:rustc-link-lib=dylib={library}");
    }
    // Mitsuba unloads plugins at exit, when the plugin's threads may still run.
    println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    // Another Mitsuba may lack functions. Lazy binding lets the version check report first.
    println!("cargo:rustc-cdylib-link-arg=-Wl,-z,lazy");
    Ok(())
}

/// The release that is installed, and the folders of its packages, their versions checked.
fn find_wheels() -> Result<(&'static Release, [PathBuf; 3]), String> {
    let python = find_python();
    println!("cargo:rerun-if-changed={}", python.display());
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
    let [(mitsuba, _), (drjit, _), (nanobind, _)] = found[..] else {
        return Err(format!("{} did not answer", python.display()));
    };
    let refused = |name: &str, wanted: &str, found: &str| {
        format!(
            "it needs {name} {wanted} in {}, where there is {found}. Run `make plugin`, which installs \
             requirements.lock into .venv, or name an interpreter that has it in SUNBEAM_PYTHON",
            python.display()
        )
    };
    let accepted = RELEASES.each_ref().map(|release| release.mitsuba).join(" or ");
    let release = RELEASES
        .iter()
        .find(|release| release.mitsuba == mitsuba)
        .ok_or_else(|| refused("mitsuba", &accepted, mitsuba))?;
    for (name, wanted, found) in [("drjit", release.drjit, drjit), ("nanobind", NANOBIND, nanobind)] {
        if wanted != found {
            return Err(refused(name, wanted, found));
        }
    }
    for (_, folder) in &found {
        println!("cargo:rerun-if-changed={folder}/__init__.py");
    }
    Ok((release, [0, 1, 2].map(|package: usize| PathBuf::from(found[package].1))))
}

/// The interpreter that has the packages: `SUNBEAM_PYTHON`, the checkout's `.venv`, or `python3`.
fn find_python() -> PathBuf {
    if let Some(python) = env::var_os("SUNBEAM_PYTHON") {
        return python.into();
    }
    let venv = Path::new(&env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("../.venv/bin/python");
    if venv.exists() { venv } else { "python3".into() }
}
