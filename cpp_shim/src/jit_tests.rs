//! Functions of Dr.Jit that the tests of tracing (`traced/tests.rs`) need beside those of `jit.rs`. `jit_tests.h`
//! describes them. A `u32` named `index`, and the result of `upload`, is the index of a variable of Dr.Jit.

pub(crate) use ffi::*;

#[allow(unreachable_pub, reason = "cxx declares all functions public")]
#[cxx::bridge(namespace = "sunbeam::jit")]
mod ffi {
    unsafe extern "C++" {
        include!("jit_tests.h");

        fn llvm_backend() -> u32;
        fn upload(backend: u32, words: &[u32]) -> u32;
        fn download(index: u32, words: &mut [u32]) -> bool;
        fn set_symbolic_loops(on: bool);
        fn references(index: u32) -> u32;
        fn all_variables() -> String;
    }
}
