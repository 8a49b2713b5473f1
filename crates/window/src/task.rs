//! Work on a thread of its own, whose result the window polls.

use eframe::egui;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::Instant;

/// Work that takes seconds, on a thread of its own. The work of a dropped task runs to its end.
pub(crate) struct Task<T> {
    /// Receives the result once.
    result: Receiver<Result<T, String>>,
    start: Instant,
}

impl<T: Send + 'static> Task<T> {
    /// Starts the work; its result repaints the window.
    pub(crate) fn start(ctx: &egui::Context, work: impl FnOnce() -> Result<T, String> + Send + 'static) -> Self {
        let (sender, result) = mpsc::channel();
        let ctx = ctx.clone();
        std::thread::spawn(move || {
            // The task may have been dropped.
            let _ = sender.send(work());
            ctx.request_repaint();
        });
        Self { result, start: Instant::now() }
    }

    /// The result when the work has ended; `None` before. An error where the work panicked, and in calls after the one
    /// that returned the result.
    pub(crate) fn poll(&self) -> Option<Result<T, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("the work ended without a result".to_owned())),
        }
    }

    /// Seconds since the start.
    pub(crate) fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
