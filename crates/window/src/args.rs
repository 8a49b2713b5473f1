//! Command line of `sunbeam view`. The comments of [`ViewArgs`] are the text of `--help`.

use crate::open::{Start, open};
use crate::settings::Settings;
use crate::sun::Sun;
use std::ops::RangeInclusive;
use sunbeam::config::Theory;
use sunbeam_cli::Outcome;
use sunbeam_cli::method_args::MethodArgs;
use sunbeam_cli::output::{Output, output};
use sunbeam_cli::realtime::Realtime;
use sunbeam_cli::scene_args::{SceneArgs, Size};
use sunbeam_cli::surface_args::SurfaceArgs;
use sunbeam_realtime::{AdapterChoice, KERATIN, Orbit};

/// Default file name of a screenshot.
const SCREENSHOT: &str = "sunbeam.png";
/// Accepted values of `--picture-scale`. The control in the panel offers a smaller range.
const PICTURE_SCALE: RangeInclusive<f32> = 0.1..=4.0;

/// Draw the snake in a window
///
/// The picture is drawn as by `sunbeam render`; surface, method, camera and sun can be changed in the window. Left drag
/// turns the camera, middle or shift drag moves the camera, the wheel zooms; right or ctrl drag turns the sun. The BRDF
/// map of the point under the cursor is shown beside the picture. S saves the picture, R resets camera and sun, Ctrl+Q
/// quits. A slow method is drawn coarsely first.
#[derive(clap::Parser)]
#[command(name = "sunbeam view", version)]
pub(crate) struct ViewArgs {
    /// Width and height of the window
    #[arg(long, value_name = "WxH", default_value = "1240x840")]
    size: Size,
    /// Where S saves the picture for the screen (.png), and beside it the linear picture as .exr; an existing file is
    /// not overwritten [default: sunbeam.png]
    #[arg(long, value_name = "FILE", value_parser = output(&["png"]))]
    screenshot: Option<Output>,
    /// Exposure in stops; each doubles the brightness, negative values darken
    #[arg(long, value_name = "STOPS", default_value_t = 2.0, allow_negative_numbers = true)]
    exposure: f64,
    /// Rays along each side of a pixel, COUNT² in all, 1 to 64; their mean is the pixel
    #[arg(long, value_name = "COUNT", default_value_t = 1)]
    supersample: u32,
    /// Resolution of the picture relative to the window's, along each side, 0.1 to 4
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    picture_scale: f32,
    /// Adapter that draws: any (a GPU if there is one) or software [default: SUNBEAM_ADAPTER, else any]
    #[arg(long, value_name = "any|software")]
    adapter: Option<AdapterChoice>,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

/// Runs `sunbeam view`: checks the options, opens the window, and returns when the window is closed.
pub(crate) fn run(args: &ViewArgs) -> Outcome {
    if !args.exposure.is_finite() {
        return Err(format!("parameter \"exposure\" is {}, but must be finite", args.exposure).into());
    }
    if !PICTURE_SCALE.contains(&args.picture_scale) {
        return Err(format!("parameter \"picture-scale\" is {}, but must be 0.1 to 4", args.picture_scale).into());
    }
    let (kind, options, surface, cache) = Realtime::new(&args.method, &args.surface)?.into_parts();
    // Errors of the surface are reported before the window opens.
    surface.height_field()?;
    if surface.theory == Theory::Rigorous {
        // A rigorous surface must also be a grating, which `profile` checks.
        surface.profile()?;
    }
    let view = args.scene.view(args.supersample)?;
    view.check()?;
    // A surface whose settings give no index is keratin here, and not a perfect conductor.
    let index = surface.index().unwrap_or(KERATIN);
    let settings = Settings {
        surface,
        kind,
        options,
        index: Some(index),
        orbit: Orbit::from(&view.camera),
        sun: Sun::from(&view.light),
        view,
        exposure: args.exposure,
        scale: args.picture_scale,
        cache,
    };
    let scene = args.scene.clone();
    open(Start {
        settings,
        make_scene: Box::new(move || scene.mesh().map_err(|error| error.to_string())),
        // In egui's points, which are pixels on a screen without scaling.
        size: [args.size.0 as f32, args.size.1 as f32],
        // A name of `--screenshot` has been checked. The default name has not, so the window opens even if the working
        // folder cannot be written to.
        screenshot: args.screenshot.as_ref().map_or_else(|| SCREENSHOT.into(), |file| file.path().to_owned()),
        adapter: args.adapter.map_or_else(AdapterChoice::from_env, Ok)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, Parser};

    #[test]
    fn no_two_arguments_have_the_same_name_and_scale_is_the_surface() {
        // Clap checks this in debug builds only.
        let mut names: Vec<_> =
            ViewArgs::command().get_arguments().filter_map(|arg| arg.get_long()).map(str::to_owned).collect();
        names.sort();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        let args = ViewArgs::try_parse_from(["view", "--scale", "0.5", "--picture-scale", "2"]).unwrap();
        assert_eq!((args.surface.config().unwrap().scale, args.picture_scale), (0.5, 2.0));
    }

    #[test]
    fn an_unusable_screenshot_is_refused_before_there_is_a_window() {
        for (name, reason) in [("a.jpg", ".png"), ("a.exr", ".png"), ("none/a.png", "there is no folder")] {
            let error = ViewArgs::try_parse_from(["view", "--screenshot", name]).err().unwrap().to_string();
            assert!(error.contains("--screenshot") && error.contains(reason), "{error}");
        }
        assert!(ViewArgs::try_parse_from(["view"]).unwrap().screenshot.is_none());
    }
}
