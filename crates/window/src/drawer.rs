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

/// The thread that draws. Pictures wait for the GPU, and the window must not; only what was asked for last is drawn.
pub struct Drawer {
    shared: Arc<Shared>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
}

/// What the window hears of the drawing.
pub enum Event {
    /// The method is on the GPU and takes so many bytes.
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

/// What has been asked for since the thread last looked.
#[derive(Default)]
struct Pending {
    scene: Option<(Mesh, PigmentTexture)>,
    method: Option<Box<dyn Method>>,
    job: Option<Job>,
    cursor: Option<Option<[f32; 2]>>,
    shot: Option<Shot>,
    quit: bool,
    /// The slightest change that ends the step under way.
    interruptible_by: Change,
}

/// What changes, the slightest last. A step ends at changes down to a certain one; a first picture is drawn whatever
/// moves meanwhile, or there would be none while one drags.
#[derive(Clone, Copy, Default, PartialEq, PartialOrd)]
enum Change {
    #[default]
    /// Another method or mesh, or the end.
    Method,
    /// Another job.
    Job,
    /// Another place under the cursor, or a screenshot.
    Cursor,
}

impl Drawer {
    /// Starts the thread; every event has the window painted.
    pub fn start(gpu: Arc<Gpu>, ctx: &egui::Context) -> Self {
        let shared = Arc::<Shared>::default();
        let (sender, events) = mpsc::channel();
        let (at_work, ctx) = (Arc::clone(&shared), ctx.clone());
        let thread = std::thread::spawn(move || {
            let tell = Teller { sender, ctx };
            match Artist::new(gpu) {
                Ok(artist) => at_work.draw(artist, &tell),
                Err(error) => tell.tell(Event::Failed(error.to_string())),
            }
        });
        Self { shared, events, thread: Some(thread) }
    }

    /// The next event, if there is one.
    pub fn next_event(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }

    /// Draws another mesh from now on.
    pub fn set_scene(&self, mesh: Mesh, pigment: PigmentTexture) {
        self.shared.post(Change::Method, |pending| pending.scene = Some((mesh, pigment)));
    }

    /// Draws with another method from now on.
    pub fn set_method(&self, method: Box<dyn Method>) {
        self.shared.post(Change::Method, |pending| pending.method = Some(method));
    }

    /// Draws this from now on.
    pub fn set_job(&self, job: Job) {
        self.shared.post(Change::Job, |pending| pending.job = Some(job));
    }

    /// Gives maps of this place from now on.
    pub fn set_cursor(&self, cursor: Option<[f32; 2]>) {
        self.shared.post(Change::Cursor, |pending| pending.cursor = Some(cursor));
    }

    /// Saves the finest picture as soon as there is one.
    pub fn save(&self, shot: Shot) {
        self.shared.post(Change::Cursor, |pending| pending.shot = Some(shot));
    }
}

impl Drop for Drawer {
    /// Waits for the thread: drivers do not like a process that ends while another thread uses them.
    fn drop(&mut self) {
        self.shared.post(Change::Method, |pending| pending.quit = true);
        if let Some(thread) = self.thread.take() {
            // It has nothing more to say, not even why it panicked, which the panic itself has said.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Pending> {
        // Whoever panicked while holding the lock left whole values.
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn post(&self, change: Change, write: impl FnOnce(&mut Pending)) {
        let mut pending = self.lock();
        write(&mut pending);
        if change <= pending.interruptible_by {
            self.stop.store(true, Ordering::Relaxed);
        }
        drop(pending);
        self.arrived.notify_one();
    }

    /// The thread: looks at what is pending, does a step, looks again.
    fn draw(&self, mut artist: Artist, tell: &Teller) {
        loop {
            let mut pending = self.lock();
            while pending.is_empty() && artist.next_step().is_none() {
                pending = self.arrived.wait(pending).unwrap_or_else(PoisonError::into_inner);
            }
            let asked = std::mem::take(&mut *pending);
            if asked.quit {
                return;
            }
            self.stop.store(false, Ordering::Relaxed);
            drop(pending);
            if let Err(error) = self.read(asked, &mut artist, tell) {
                tell.tell(Event::Failed(error.to_string()));
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
                Ok(Some(Done::Picture(picture))) => tell.tell(Event::Picture(picture)),
                Ok(Some(Done::Map(map))) => tell.tell(Event::Map(map)),
                Ok(Some(Done::Saved(path))) => tell.tell(Event::Saved(path)),
                Ok(None) | Err(Failure::Gpu(GpuError::Stopped)) => {}
                Err(error) => {
                    if !matches!(error, Failure::File(_)) {
                        artist.give_up();
                    }
                    tell.tell(Event::Failed(error.to_string()));
                }
            }
        }
    }

    /// Says what ends the step that follows; false when something is pending that is to be read before it.
    fn begin(&self, interruptible_by: Change) -> bool {
        let mut pending = self.lock();
        if !pending.is_empty() {
            return false;
        }
        pending.interruptible_by = interruptible_by;
        true
    }

    fn read(&self, asked: Pending, artist: &mut Artist, tell: &Teller) -> Result<(), GpuError> {
        // The job first: whatever is built has its optics, and is drawn even where something else fails.
        if let Some(job) = asked.job {
            artist.set_job(job);
        }
        if let Some(cursor) = asked.cursor {
            artist.set_cursor(cursor);
        }
        if let Some(shot) = asked.shot {
            artist.set_shot(shot);
        }
        if let Some((mesh, pigment)) = asked.scene {
            artist.set_scene(&mesh, &pigment)?;
        }
        if let Some(method) = asked.method {
            tell.tell(Event::Uploaded(artist.set_method(&*method, Arc::clone(&self.stop))?));
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

struct Teller {
    sender: Sender<Event>,
    ctx: egui::Context,
}

impl Teller {
    fn tell(&self, event: Event) {
        // Nobody listens any more when the window is being closed.
        let _ = self.sender.send(event);
        self.ctx.request_repaint();
    }
}
