//! The window on a virtual display, driven by keys and mouse.

#![allow(clippy::unwrap_used, reason = "also outside `#[test]` functions")]

use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use sunbeam_realtime::{AdapterChoice, Gpu, GpuError};

/// Time limit of every step: software adapters on loaded machines are slow.
const DEADLINE: Duration = Duration::from_secs(240);
/// Pause between two polls, and between events that must not fall into one frame.
const PAUSE: Duration = Duration::from_millis(250);
/// Polls after which events are sent again.
const PATIENCE: usize = 20;
/// The controls are 264 pixels wide, the rest is the picture.
const SIZE: &str = "520x300";
const MIDDLE_OF_PICTURE: [&str; 2] = ["390", "150"];

/// A process that is killed when it is dropped.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual display; `None` without Xvfb.
fn display() -> Option<(Process, String)> {
    let mut command = Command::new("Xvfb");
    // Without -noreset it restarts whenever its last client leaves, as xdotool does, and refuses clients meanwhile.
    command.args(["-noreset", "-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"]);
    let mut child = match command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn() {
        Err(error) if error.kind() == ErrorKind::NotFound => return None,
        spawned => spawned.unwrap(),
    };
    let mut number = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut number).unwrap();
    Some((Process(child), format!(":{}", number.trim())))
}

/// Whether the display, its input and the GPU adapter are present; what is missing is reported as a skip.
fn can_run() -> bool {
    if let Err(error @ GpuError::NoAdapter { .. }) = Gpu::open(AdapterChoice::from_env().unwrap()) {
        sunbeam_testing::skip("gpu", error);
        return false;
    }
    let missing = |program: &&str| Command::new(program).arg("-help").output().is_err();
    if let Some(program) = ["Xvfb", "xdotool"].into_iter().find(missing) {
        sunbeam_testing::skip("display", format_args!("{program} is not installed"));
        return false;
    }
    true
}

/// Keys and mouse on a display.
struct Hand<'a> {
    display: &'a str,
}

impl Hand<'_> {
    fn does(&self, arguments: &[&str]) -> Option<String> {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", self.display).output().unwrap();
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
    }

    /// A drag in steps, with pauses so that a slow window handles them one by one.
    fn drags(&self, button: &str) {
        self.does(&[&["mousemove"], &MIDDLE_OF_PICTURE[..]].concat());
        for step in
            [&["mousedown", button][..], &["mousemove_relative", "40", "10"], &["mousemove_relative", "40", "10"]]
        {
            std::thread::sleep(PAUSE);
            self.does(step);
        }
        std::thread::sleep(PAUSE);
        self.does(&["mouseup", button]);
    }
}

/// The messages of a window that has closed.
fn said(window: &mut Process) -> String {
    let mut said = String::new();
    window.0.stderr.as_mut().unwrap().read_to_string(&mut said).unwrap();
    said
}

/// Polls until there is an answer; acts before the first poll and again after every [`PATIENCE`] polls.
fn eventually<T>(awaited: &str, window: &mut Process, mut act: impl FnMut(), mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    for poll in 0.. {
        if poll % PATIENCE == 0 {
            act();
        }
        if let Some(answer) = ask() {
            return answer;
        }
        if let Some(status) = window.0.try_wait().unwrap() {
            panic!("the window closed with {status} while waiting for {awaited}: {}", said(window));
        }
        assert!(start.elapsed() < DEADLINE, "no {awaited} after {DEADLINE:?}");
        std::thread::sleep(PAUSE);
    }
    unreachable!()
}

/// Size and bytes of a PNG; `None` while it is incomplete.
fn picture(path: &Path) -> Option<(u32, u32, Vec<u8>)> {
    let mut reader = png::Decoder::new(BufReader::new(std::fs::File::open(path).ok()?)).read_info().ok()?;
    let mut bytes = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut bytes).ok()?;
    Some((info.width, info.height, bytes))
}

/// All complete screenshots.
fn pictures(folder: &Path) -> Vec<PathBuf> {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.extension().is_some_and(|extension| extension == "png") && picture(path).is_some())
        .collect()
}

#[test]
fn a_window_draws_saves_and_follows_the_sun() {
    if !can_run() {
        return;
    }
    let (_server, display) = display().unwrap();
    let hand = Hand { display: &display };
    let folder = tempfile::tempdir().unwrap();
    let shot = folder.path().join("shot.png");
    let child = Command::new(env!("CARGO_BIN_EXE_sunbeam-view"))
        .args(["--preset", "blazed", "--method", "stam", "--resolution", "1", "--size", SIZE, "--screenshot"])
        .arg(&shot)
        .env("DISPLAY", &display)
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut window = Process(child);

    let id =
        eventually("window", &mut window, || {}, || hand.does(&["search", "--onlyvisible", "--name", "^sunbeam$"]));
    let press_s = || {
        // Without a window manager, the window needs the focus.
        hand.does(&["windowfocus", id.trim()]);
        hand.does(&[&["mousemove"], &MIDDLE_OF_PICTURE[..]].concat());
        hand.does(&["key", "s"]);
    };
    let (width, height, before) = eventually("screenshot", &mut window, press_s, || picture(&shot));
    assert_eq!((width, height), (520 - 264, 300));
    assert!(before.iter().any(|&byte| byte > 100), "the picture is dark");
    assert!(before.chunks_exact(3).any(|rgb| rgb.iter().max().unwrap() - rgb.iter().min().unwrap() > 50), "no colours");

    let linear = exr::prelude::read_first_rgba_layer_from_file(
        shot.with_extension("exr"),
        |size, _| vec![0.0f32; size.area()],
        |brightness: &mut Vec<f32>, at, (r, g, b, _): (f32, f32, f32, f32)| {
            brightness[at.y() * 256 + at.x()] = r + g + b;
        },
    )
    .unwrap();
    let brightness = linear.layer_data.channel_data.pixels;
    assert_eq!(brightness.len(), 256 * 300);
    assert!(brightness.iter().all(|value| value.is_finite()) && brightness.iter().any(|&value| value > 0.1));

    let drag_and_press_s = || {
        hand.drags("3");
        press_s();
    };
    eventually("picture with the sun elsewhere", &mut window, drag_and_press_s, || {
        pictures(folder.path()).iter().find(|path| picture(path).is_some_and(|(.., bytes)| bytes != before)).cloned()
    });

    let quit = || {
        hand.does(&["key", "ctrl+q"]);
    };
    quit();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = window.0.try_wait().unwrap() {
            break status;
        }
        assert!(start.elapsed() < DEADLINE, "the window does not close");
        std::thread::sleep(PAUSE);
    };
    let said = said(&mut window);
    assert!(status.success() && said.is_empty(), "{status}: {said}");
}

/// The message of a window that does not open.
fn refused(arguments: &[&str], variables: &[(&str, &str)]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sunbeam-view"));
    command.args(["--preset", "blazed", "--method", "stam"]).args(arguments);
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    let output = command.envs(variables.iter().copied()).output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}, {variables:?}: {message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

#[test]
fn a_window_that_cannot_open_ends_with_one_line_and_status_2() {
    // Faults that are found before the display is opened.
    for (arguments, mentioned) in [
        (&["--size", "large"][..], "--size"),
        (&["--scale", "9"], "\"scale\" is 9, but must be a size relative to the relief"),
        (&["--picture-scale", "9"], "\"picture-scale\""),
        (&["--exposure", "NaN"], "\"exposure\""),
        (&["--supersample", "0"], "\"supersample\""),
        (&["--camera-target", "-1.2,-7,8.5"], "\"camera-target\""),
        (&["--theory", "rigorous"], "--theory must be scalar"),
    ] {
        let message = refused(arguments, &[]);
        assert!(message.contains(mentioned), "{message}");
    }
    for variables in [&[][..], &[("DISPLAY", ":1234567")]] {
        let message = refused(&[], variables);
        assert!(message.contains("DISPLAY") || message.contains("libxkbcommon"), "{message}");
    }
    let Some((_server, display)) = display() else { return sunbeam_testing::skip("display", "Xvfb is not installed") };
    let message = refused(&[], &[("DISPLAY", &display), ("VK_DRIVER_FILES", "/none"), ("VK_ICD_FILENAMES", "/none")]);
    assert!(message.contains("libvulkan1 mesa-vulkan-drivers"), "{message}");
}
