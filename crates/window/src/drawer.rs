//! The thread that draws. The window posts *orders*: another scene, method, job or cursor, or a screenshot. A *job*
//! is all inputs of a picture except scene and method; the *cursor* is the point of the picture whose BRDF map is
//! shown. The thread works in *steps* of the [`Artist`]: it draws one picture or map, or writes the screenshot. It
//! reads orders between steps and sends results as events. An order may end the step under way, if the step is not
//! worth finishing ([`Change`]).

use super::artist::{Artist, Done, Failure, Picture, Shot, Step};
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

/// The window's handle of the thread that draws. Drawing waits for the GPU, and the window must not. A new order
/// replaces an older one of its kind.
pub(crate) struct Drawer {
    shared: Arc<Shared>,
    /// Results of the thread.
    events: Receiver<Event>,
    /// `None` only while the drawer is dropped.
    thread: Option<JoinHandle<()>>,
}

/// Result for the window.
pub(crate) enum Event {
    /// The method is on the GPU and takes this number of bytes.
    Uploaded(u64),
    /// A picture has been drawn.
    Picture(Picture),
    /// A map has been drawn; `None` where the point under the cursor has none ([`Done::Map`]).
    Map(Option<BrdfMap>),
    /// The screenshot with this PNG has been written.
    Saved(PathBuf),
    /// An order failed for this reason.
    Failed(String),
}

/// State that the window and the thread share.
#[derive(Default)]
struct Shared {
    /// Orders that the thread has not read yet.
    pending: Mutex<Pending>,
    /// Wakes the thread when an order has been posted.
    arrived: Condvar,
    /// Flag that ends the step under way: evaluations of the method then fail with [`GpuError::Stopped`]
    /// ([`Artist::set_method`]).
    stop: Arc<AtomicBool>,
}

/// Orders posted since the thread last read them, `None` for no order, and what may end the step under way.
#[derive(Default)]
struct Pending {
    /// Mesh and its pigment.
    scene: Option<(Mesh, PigmentTexture)>,
    /// Method to draw with.
    method: Option<Box<dyn Method>>,
    /// View, optics and size of the pictures.
    job: Option<Job>,
    /// Order of a map at a point of the picture, or, with an inner `None`, of no map; see [`Drawer::set_cursor`].
    cursor: Option<Option<[f32; 2]>>,
    /// Screenshot to save.
    shot: Option<Shot>,
    /// Whether the thread is to end.
    quit: bool,
    /// The smallest change that ends the step under way; the default between steps. A flag `stop` set between steps
    /// ends nothing, since the thread clears it when it reads the orders.
    interruptible_by: Change,
}

/// Kinds of changes, from the smallest to the largest. Each step has a smallest kind that ends it; larger kinds end it,
/// too.
#[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
enum Change {
    /// Another point under the cursor, or a screenshot.
    CursorOrShot,
    /// Another job.
    Job,
    /// Another method or scene, or the end of the thread.
    #[default]
    MethodOrScene,
}

impl Change {
    /// The smallest change that ends a step of the artist. A step refines if it draws a finer picture or map than one
    /// that has been drawn.
    fn smallest_to_end(step: Step, artist: &Artist) -> Self {
        match (artist.refines(step), artist.has_shot()) {
            // A new job does not end a first picture or map, since otherwise a drag would show no pictures. Neither
            // does it end the writing of a screenshot.
            (false, _) => Self::MethodOrScene,
            // Another cursor does not end a picture that a screenshot waits for.
            (true, true) => Self::Job,
            (true, false) => Self::CursorOrShot,
        }
    }
}

impl Drawer {
    /// Starts the thread. Each event repaints the window.
    pub(crate) fn start(gpu: Arc<Gpu>, ctx: &egui::Context) -> Self {
        let shared = Arc::<Shared>::default();
        let (sender, events) = mpsc::channel();
        let (thread_shared, ctx) = (Arc::clone(&shared), ctx.clone());
        let thread = std::thread::spawn(move || {
            let reporter = Reporter { sender, ctx };
            match Artist::new(gpu) {
                Ok(artist) => thread_shared.run(artist, &reporter),
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
        self.shared.post(Change::MethodOrScene, |pending| pending.scene = Some((mesh, pigment)));
    }

    /// Draws with another method from now on.
    pub(crate) fn set_method(&self, method: Box<dyn Method>) {
        self.shared.post(Change::MethodOrScene, |pending| pending.method = Some(method));
    }

    /// Draws this job from now on.
    pub(crate) fn set_job(&self, job: Job) {
        self.shared.post(Change::Job, |pending| pending.job = Some(job));
    }

    /// Draws BRDF maps of this point of the picture from now on; `None` for no maps. Each coordinate is in [0, 1) from
    /// the picture's upper left.
    pub(crate) fn set_cursor(&self, cursor: Option<[f32; 2]>) {
        self.shared.post(Change::CursorOrShot, |pending| pending.cursor = Some(cursor));
    }

    /// Saves the finest picture of the job as soon as it is drawn.
    pub(crate) fn save(&self, shot: Shot) {
        self.shared.post(Change::CursorOrShot, |pending| pending.shot = Some(shot));
    }
}

impl Drop for Drawer {
    /// Waits for the thread: drivers may crash in a process that ends while another thread uses them.
    fn drop(&mut self) {
        self.shared.post(Change::MethodOrScene, |pending| pending.quit = true);
        if let Some(thread) = self.thread.take() {
            // The message of a panic has been printed already.
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// The pending orders. A panic of the other thread leaves them intact.
    fn lock(&self) -> MutexGuard<'_, Pending> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes an order with `write`. Ends the step under way if `change` is large enough.
    fn post(&self, change: Change, write: impl FnOnce(&mut Pending)) {
        let mut pending = self.lock();
        write(&mut pending);
        if change >= pending.interruptible_by {
            self.stop.store(true, Ordering::Relaxed);
        }
        drop(pending);
        self.arrived.notify_one();
    }

    /// The thread's loop: reads the orders and does one step of the artist, until the thread is to end.
    fn run(&self, mut artist: Artist, reporter: &Reporter) {
        loop {
            let mut pending = self.lock();
            // Sleeps while there is nothing to do.
            while pending.is_empty() && artist.next_step().is_none() {
                pending = self.arrived.wait(pending).unwrap_or_else(PoisonError::into_inner);
            }
            let orders = std::mem::take(&mut *pending);
            if orders.quit {
                return;
            }
            self.stop.store(false, Ordering::Relaxed);
            drop(pending);
            if let Err(error) = self.hand_over(orders, &mut artist, reporter) {
                reporter.report(Event::Failed(error.to_string()));
            }
            let Some(step) = artist.next_step() else { continue };
            if !self.begin(Change::smallest_to_end(step, &artist)) {
                continue;
            }
            let done = artist.work(step);
            self.lock().interruptible_by = Change::default();
            match done {
                Ok(Some(Done::Picture(picture))) => reporter.report(Event::Picture(picture)),
                Ok(Some(Done::Map(map))) => reporter.report(Event::Map(map)),
                Ok(Some(Done::Saved(path))) => reporter.report(Event::Saved(path)),
                // The step had nothing to draw, or was ended by an order.
                Ok(None) | Err(Failure::Gpu(GpuError::Stopped)) => {}
                Err(error) => {
                    // Without its job the step is not repeated, as it would fail again. A screenshot that cannot be
                    // written has been dropped already, and the job stays.
                    if !matches!(error, Failure::File(_)) {
                        artist.give_up();
                    }
                    reporter.report(Event::Failed(error.to_string()));
                }
            }
        }
    }

    /// Sets the smallest change that ends the next step. Returns false, and sets nothing, if an order has been posted,
    /// which must be read first.
    fn begin(&self, interruptible_by: Change) -> bool {
        let mut pending = self.lock();
        if !pending.is_empty() {
            return false;
        }
        pending.interruptible_by = interruptible_by;
        true
    }

    /// Hands the orders to the artist. If the scene fails, an order of a method in `orders` is dropped, since nothing
    /// is drawn without a scene.
    fn hand_over(&self, orders: Pending, artist: &mut Artist, reporter: &Reporter) -> Result<(), GpuError> {
        // Scene and method come last, because only they can fail.
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
    /// Whether there is no order.
    fn is_empty(&self) -> bool {
        let Self { scene, method, job, cursor, shot, quit, interruptible_by: _ } = self;
        scene.is_none() && method.is_none() && job.is_none() && cursor.is_none() && shot.is_none() && !quit
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
