use super::artist::{Artist, Done, Failure, Picture, Shot};
use super::hemisphere::BrdfMap;
use eframe::egui;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use sunbeam::methods::Method;
use sunbeam_realtime::progressive::Job;
use sunbeam_realtime::snake::PigmentTexture;
use sunbeam_realtime::{Gpu, GpuError, Mesh};

/// The thread that draws. Pictures wait for the GPU, and the window must not. Only the last order is drawn.
pub(crate) struct Drawer {
    shared: Arc<Shared>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
}

/// News of the drawing for the window.
pub(crate) enum Event {
    /// The method is on the GPU, with this many bytes.
    Uploaded(u64),
    Picture(Picture),
    /// `None` where the cursor is not on the lit side of the mesh.
    Map(Option<BrdfMap>),
    Saved(PathBuf),
    Failed(String),
}

#[derive(Default)]
struct Shared {
    pending: Mutex<Pending>,
    arrived: Condvar,
    /// Ends the step under way.
    stop: Arc<AtomicBool>,
}

/// Orders since the thread last read them.
#[derive(Default)]
struct Pending {
    scene: Option<(Mesh, PigmentTexture)>,
    method: Option<Box<dyn Method>>,
    job: Option<Job>,
    cursor: Option<Option<[f32; 2]>>,
    shot: Option<Shot>,
    quit: bool,
    /// The smallest change that ends the step under way.
    interruptible_by: Change,
}

/// Kinds of changes, from the largest to the smallest. A step ends at a change of a certain kind or a larger one. A
/// first picture is drawn to its end in spite of new jobs: otherwise a drag would show no pictures.
#[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
enum Change {
    #[default]
    /// Another method or mesh, or the end.
    Method,
    /// Another job.
    Job,
    /// Another point under the cursor, or a screenshot.
    Cursor,
}

impl Drawer {
    /// Starts the thread. Each event repaints the window.
    pub(crate) fn start(gpu: Arc<Gpu>, ctx: &egui::Context) -> Self {
        let shared = Arc::<Shared>::default();
        let (sender, events) = mpsc::channel();
        let (at_work, ctx) = (Arc::clone(&shared), ctx.clone());
        let thread = std::thread::spawn(move || {
            let reporter = Reporter { sender, ctx };
            match Artist::new(gpu) {
                Ok(artist) => at_work.draw(artist, &reporter),
                Err(error) => reporter.report(Event::Failed(error.to_string())),
            }
        });
        Self { shared, events, thread: Some(thread) }
    }

    /// The next event, if there is one.
    pub(crate) fn next_event(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }

    /// Draws another mesh from now on.
    pub(crate) fn set_scene(&self, mesh: Mesh, pigment: PigmentTexture) {
        self.shared.post(Change::Method, |pending| pending.scene = Some((mesh, pigment)));
    }

    /// Draws with another method from now on.
    pub(crate) fn set_method(&self, method: Box<dyn Method>) {
        self.shared.post(Change::Method, |pending| pending.method = Some(method));
    }

    /// Draws this job from now on.
    pub(crate) fn set_job(&self, job: Job) {
        self.shared.post(Change::Job, |pending| pending.job = Some(job));
    }

    /// Draws maps of this point from now on.
    pub(crate) fn set_cursor(&self, cursor: Option<[f32; 2]>) {
        self.shared.post(Change::Cursor, |pending| pending.cursor = Some(cursor));
    }

    /// Saves the finest picture as soon as there is one.
    pub(crate) fn save(&self, shot: Shot) {
        self.shared.post(Change::Cursor, |pending| pending.shot = Some(shot));
    }
}

impl Drop for Drawer {
    /// Waits for the thread: drivers may crash in a process that ends while another thread uses them.
    fn drop(&mut self) {
        self.shared.post(Change::Method, |pending| pending.quit = true);
        if let Some(thread) = self.thread.take() {
            // The message of a panic has been printed already.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Pending> {
        // A panic of the other thread leaves the orders intact.
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes an order and ends the step under way where the change is large enough.
    fn post(&self, change: Change, write: impl FnOnce(&mut Pending)) {
        let mut pending = self.lock();
        write(&mut pending);
        if change <= pending.interruptible_by {
            self.stop.store(true, Ordering::Relaxed);
        }
        drop(pending);
        self.arrived.notify_one();
    }

    /// The thread's loop: reads the orders, does a step.
    fn draw(&self, mut artist: Artist, reporter: &Reporter) {
        loop {
            let mut pending = self.lock();
            while pending.is_empty() && artist.next_step().is_none() {
                pending = self.arrived.wait(pending).unwrap_or_else(PoisonError::into_inner);
            }
            let orders = std::mem::take(&mut *pending);
            if orders.quit {
                return;
            }
            self.stop.store(false, Ordering::Relaxed);
            drop(pending);
            if let Err(error) = self.read(orders, &mut artist, reporter) {
                reporter.report(Event::Failed(error.to_string()));
            }
            let Some(step) = artist.next_step() else { continue };
            if !self.begin(match (artist.refines(step), artist.owes_shot()) {
                (false, _) => Change::Method,
                (true, true) => Change::Job,
                (true, false) => Change::Cursor,
            }) {
                continue;
            }
            let done = artist.work(step);
            self.lock().interruptible_by = Change::default();
            match done {
                Ok(Some(Done::Picture(picture))) => reporter.report(Event::Picture(picture)),
                Ok(Some(Done::Map(map))) => reporter.report(Event::Map(map)),
                Ok(Some(Done::Saved(path))) => reporter.report(Event::Saved(path)),
                Ok(None) | Err(Failure::Gpu(GpuError::Stopped)) => {}
                Err(error) => {
                    if !matches!(error, Failure::File(_)) {
                        artist.give_up();
                    }
                    reporter.report(Event::Failed(error.to_string()));
                }
            }
        }
    }

    /// Sets the changes that end the next step; false where an order came in, which is read first.
    fn begin(&self, interruptible_by: Change) -> bool {
        let mut pending = self.lock();
        if !pending.is_empty() {
            return false;
        }
        pending.interruptible_by = interruptible_by;
        true
    }

    /// Hands the orders to the artist.
    fn read(&self, orders: Pending, artist: &mut Artist, reporter: &Reporter) -> Result<(), GpuError> {
        // The job first: method and scene are drawn with its optics, even where one of them fails.
        if let Some(job) = orders.job {
            artist.set_job(job);
        }
        if let Some(cursor) = orders.cursor {
            artist.set_cursor(cursor);
        }
        if let Some(shot) = orders.shot {
            artist.set_shot(shot);
        }
        if let Some((mesh, pigment)) = orders.scene {
            artist.set_scene(&mesh, &pigment)?;
        }
        if let Some(method) = orders.method {
            reporter.report(Event::Uploaded(artist.set_method(&*method, Arc::clone(&self.stop))?));
        }
        Ok(())
    }
}

impl Pending {
    fn is_empty(&self) -> bool {
        let nothing = self.scene.is_none() && self.method.is_none() && self.job.is_none();
        nothing && self.cursor.is_none() && self.shot.is_none() && !self.quit
    }
}

/// Sends events to the window and repaints it.
struct Reporter {
    sender: Sender<Event>,
    ctx: egui::Context,
}

impl Reporter {
    fn report(&self, event: Event) {
        // The window may be closing.
        let _ = self.sender.send(event);
        self.ctx.request_repaint();
    }
}
