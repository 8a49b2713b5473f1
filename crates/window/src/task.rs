use eframe::egui;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::Instant;

/// Work that takes seconds, on a thread of its own. Dropping it leaves the thread to end by itself.
pub struct Task<T> {
    result: Receiver<Result<T, String>>,
    since: Instant,
}

impl<T: Send + 'static> Task<T> {
    /// Starts the work; the window is painted once more when it is done.
    pub fn start(ctx: &egui::Context, work: impl FnOnce() -> Result<T, String> + Send + 'static) -> Self {
        let (sender, result) = mpsc::channel();
        let ctx = ctx.clone();
        std::thread::spawn(move || {
            // Nobody may be waiting any more.
            let _ = sender.send(work());
            ctx.request_repaint();
        });
        Self { result, since: Instant::now() }
    }

    /// What came out of it, once.
    pub fn poll(&self) -> Option<Result<T, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("the work ended without a result".to_owned())),
        }
    }

    /// For how long it has been going on.
    pub fn seconds(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }
}
