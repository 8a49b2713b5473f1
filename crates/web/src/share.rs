//! Exports the page's picture: as a `sunbeam render` command, and as an XML scene for Mitsuba with the `diffraction`
//! plugin. The command's options of the surface have the names of the plugin's parameters with hyphens for underscores,
//! except `height-field` for `filename`. [`Settings`] refuse the rigorous theory and the transmission `interface`, so a
//! transparent body is a film.

use crate::settings::{Pigment, Settings};
use serde::Serialize;
use serde_json::Value;
use sunbeam::config::{ReliefSource, Source, SurfaceConfig};
use sunbeam::methods::{MethodKind, MethodOptions, Repeats, StamForm};
use sunbeam_realtime::{Camera, PIGMENT_SCALE, SOIL, Shape};

/// The `sunbeam render` command that draws the picture of `width` × `height` pixels, with `supersample` rays along each
/// side of a pixel. Options of surface and method with the library's defaults are left out.
pub fn command(settings: &Settings, (width, height): (u32, u32), supersample: u32) -> String {
    let mut parts = vec!["sunbeam render -o picture.exr --png picture.png".to_owned()];
    let mut add = |flag: &str, value: String| parts.push(format!("--{flag} {}", quoted(&value)));
    add("size", format!("{width}x{height}"));
    if supersample > 1 {
        add("supersample", supersample.to_string());
    }
    add("exposure", settings.exposure.to_string());
    for (name, value) in surface_parameters(settings).into_iter().chain(method_options(settings)) {
        // The form of GPU Gems has neither factor, so the command refuses both options with it.
        if is_gems(settings) && ["obliquity", "shadowing"].contains(&name) {
            continue;
        }
        let flag = if name == "filename" { "height-field".to_owned() } else { name.replace('_', "-") };
        add(&flag, value);
    }
    // The snake is the command's default shape, and the only one whose mesh has a resolution.
    match settings.shape {
        Shape::Snake => add("resolution", settings.resolution.to_string()),
        shape => add("shape", shape.name().to_owned()),
    }
    match settings.pigment {
        // The command's default.
        Pigment::Physical => {}
        // A film has no diffuse layer, so it has no pigment.
        _ if settings.surface.body().is_some() => {}
        Pigment::Mix => {
            add("blend", "mix".to_owned());
            add("share", settings.share.to_string());
        }
        Pigment::None => add("blend", "none".to_owned()),
    }
    if !settings.ground {
        add("ground", "false".to_owned());
    }
    if settings.rotation_deg != 0.0 {
        add("rotation", settings.rotation_deg.to_string());
    }
    let Camera { origin, target, fov_deg } = settings.camera.orbit().camera();
    add("camera-origin", coordinates(origin, ","));
    add("camera-target", coordinates(target, ","));
    add("fov", fov_deg.to_string());
    add("light-azimuth", settings.sun.azimuth_deg.to_string());
    add("light-elevation", settings.sun.elevation_deg.to_string());
    parts.join(" ")
}

/// The XML scene of the picture of `size` = (width, height) in pixels. The plugin has only the method `table`, and not
/// [`Pigment::Mix`]. For other methods the scene has the model that they approximate, and for `Mix` the pigment of
/// [`Pigment::Physical`].
pub fn xml(settings: &Settings, size: (u32, u32)) -> String {
    let mut scene = String::new();
    let mut line = |text: &str| {
        scene.push_str(text);
        scene.push('\n');
    };
    scene_comment(settings, &mut line);
    line("<scene version=\"3.0.0\">");
    // Paths of two segments, from camera to surface to sun, as in the page's picture. The ground behind a film is seen
    // by paths of three.
    let max_depth = if settings.surface.body().is_some() { 3 } else { 2 };
    line(&format!("    <integrator type=\"path\"><integer name=\"max_depth\" value=\"{max_depth}\"/></integrator>"));
    scene_camera(settings, size, &mut line);
    scene_shape(settings, &mut line);
    if settings.ground {
        // Mitsuba's rectangle has a side of 2. Its scale is half the side of the ground in cm
        // (POINT_GROUND_HALF_SIDE_CM of point.wgsl).
        line("    <shape type=\"rectangle\">");
        line("        <transform name=\"to_world\"><scale value=\"200\"/></transform>");
        line("        <bsdf type=\"diffuse\">");
        line(&format!("            <rgb name=\"reflectance\" value=\"{}, {}, {}\"/>", SOIL[0], SOIL[1], SOIL[2]));
        line("        </bsdf>");
        line("    </shape>");
    }
    scene_sun(settings, &mut line);
    line("</scene>");
    scene
}

/// Writes the comment at the head of the scene, line by line: the commands that make the mesh and draw the picture.
fn scene_comment(settings: &Settings, line: &mut impl FnMut(&str)) {
    line("<!-- The picture of the page, lit by the sun alone; lengths in cm, z up. Save this as picture.xml, then run");
    line("");
    if settings.shape == Shape::Snake {
        // XML comments may not contain two hyphens.
        line("     sunbeam snake -o snake.ply");
        line(&format!("     with the options resolution {}, pigment pigment.exr,", settings.resolution));
        line(&format!("     and pigment-scale {PIGMENT_SCALE}, then"));
        line("");
    }
    line("     mitsuba -a target/mitsuba -m llvm_ad_spectral picture.xml");
    if settings.method != MethodKind::Table {
        line("");
        line(&format!(
            "     The picture was drawn by the method {}, which Mitsuba does not have: this is the",
            settings.method
        ));
        line("     relief that it approximates.");
    }
    line("-->");
}

/// Writes the XML of the camera and its film of `width` × `height` pixels, line by line.
fn scene_camera(settings: &Settings, (width, height): (u32, u32), line: &mut impl FnMut(&str)) {
    let Camera { origin, target, fov_deg } = settings.camera.orbit().camera();
    line("    <sensor type=\"perspective\">");
    line(&format!("        <float name=\"fov\" value=\"{fov_deg}\"/>"));
    let (origin, target) = (coordinates(origin, ", "), coordinates(target, ", "));
    line("        <transform name=\"to_world\">");
    line(&format!("            <lookat origin=\"{origin}\" target=\"{target}\" up=\"0, 0, 1\"/>"));
    line("        </transform>");
    // More samples lower the noise and take longer.
    line("        <sampler type=\"multijitter\"><integer name=\"sample_count\" value=\"64\"/></sampler>");
    line("        <film type=\"hdrfilm\">");
    line(&format!("            <integer name=\"width\" value=\"{width}\"/>"));
    line(&format!("            <integer name=\"height\" value=\"{height}\"/>"));
    line("        </film>");
    line("    </sensor>");
}

/// Writes the XML of the sun, line by line. Its irradiance π lights a white diffuse surface that faces the sun to a
/// radiance of 1.
fn scene_sun(settings: &Settings, line: &mut impl FnMut(&str)) {
    let (azimuth, elevation) = (settings.sun.azimuth_deg.to_radians(), settings.sun.elevation_deg.to_radians());
    let to_sun = [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
    line("    <emitter type=\"directional\">");
    line(&format!("        <vector name=\"direction\" value=\"{}\"/>", coordinates(to_sun.map(|c| -c), ", ")));
    line("        <spectrum name=\"irradiance\" type=\"d65\">");
    line(&format!("            <float name=\"scale\" value=\"{}\"/>", std::f64::consts::PI));
    line("        </spectrum>");
    line("    </emitter>");
}

/// Writes the XML of the shape with its material, line by line.
fn scene_shape(settings: &Settings, write_line: &mut impl FnMut(&str)) {
    // All lines are indented by one level more.
    let mut line = |text: &str| write_line(&format!("    {text}"));
    match settings.shape {
        Shape::Snake => {
            line("<shape type=\"ply\">");
            line("    <string name=\"filename\" value=\"snake.ply\"/>");
        }
        Shape::Flat => {
            line("<shape type=\"rectangle\">");
            line("    <transform name=\"to_world\">");
            line(&format!("        <scale value=\"{}\"/>", Shape::FLAT_HALF_SIDE_CM));
            let [x, y, z] = Shape::FLAT_CENTRE_CM;
            line(&format!("        <translate x=\"{x}\" y=\"{y}\" z=\"{z}\"/>"));
            line("    </transform>");
        }
        Shape::Sphere => {
            line("<shape type=\"sphere\">");
            let [x, y, z] = Shape::SPHERE_CENTRE_CM;
            line(&format!("    <point name=\"center\" x=\"{x}\" y=\"{y}\" z=\"{z}\"/>"));
            line(&format!("    <float name=\"radius\" value=\"{}\"/>", Shape::SPHERE_RADIUS_CM));
        }
    }
    // The plugin's film handles both sides; an opaque surface needs the adapter `twosided`.
    let is_film = settings.surface.body().is_some();
    if !is_film {
        line("    <bsdf type=\"twosided\">");
    }
    line("        <bsdf type=\"diffraction\">");
    let is_number = |value: &str| value.parse::<f64>().is_ok();
    for (name, value) in surface_parameters(settings) {
        let kind = match (name, value.as_str()) {
            // Strings, even if they look like numbers. The plugin reads all its numbers as floats.
            ("filename" | "channel", _) => "string",
            (_, "true" | "false") => "boolean",
            (_, value) if is_number(value) => "float",
            _ => "string",
        };
        line(&format!("            <{kind} name=\"{name}\" value=\"{}\"/>", escaped(&value)));
    }
    if settings.rotation_deg != 0.0 {
        line(&format!("            <float name=\"rotation\" value=\"{}\"/>", settings.rotation_deg));
    }
    match (settings.pigment, settings.shape) {
        (Pigment::None, _) => {}
        // A film has no diffuse layer, so it has no pigment.
        _ if is_film => {}
        (_, Shape::Snake) => {
            line("            <texture type=\"bitmap\" name=\"diffuse_reflectance\">");
            line("                <string name=\"filename\" value=\"pigment.exr\"/>");
            line("            </texture>");
        }
        (_, Shape::Flat | Shape::Sphere) => {
            let [r, g, b] = Shape::BARE_PIGMENT.map(|value| value * f64::from(PIGMENT_SCALE));
            line(&format!("            <rgb name=\"diffuse_reflectance\" value=\"{r:.6}, {g:.6}, {b:.6}\"/>"));
        }
    }
    line("        </bsdf>");
    if !is_film {
        line("    </bsdf>");
    }
    line("</shape>");
}

/// Names and values of the plugin's parameters: those that select the relief, those that differ from the library's
/// defaults, and always `eta` and `conserve_energy`. A new field of [`SurfaceConfig`] must be added here, unless
/// [`ReliefSource::NAMES`] has it.
fn surface_parameters(settings: &Settings) -> Vec<(&'static str, String)> {
    let (mut config, default) = (settings.config(), SurfaceConfig::default());
    // A preset that is the default is written, too.
    if let Source::Preset(preset) = config.source() {
        config.preset = Some(preset);
    }
    // Fields without a value are missing in `fields`.
    let fields = serde_json::to_value(&config).unwrap_or_default();
    let given = |name: &&'static str| Some((*name, plain(fields.get(name)?)));
    let mut parameters: Vec<_> = ReliefSource::NAMES.iter().filter_map(given).collect();
    let mut number = |name, value: f64, default: f64| {
        if value != default {
            parameters.push((name, value.to_string()));
        }
    };
    number("scale", config.scale, default.scale);
    number("depth", config.depth, default.depth);
    number("coherence_length", config.coherence_length, default.coherence_length);
    number("tolerance", config.tolerance, default.tolerance);
    number("build_limit", config.build_limit, default.build_limit);
    number("k", settings.index().k, 0.0);
    number("cover_eta", config.cover_eta.unwrap_or(1.0), 1.0);
    // `eta` is always written: without an index the plugin's surface would reflect all light.
    parameters.push(("eta", settings.index().eta.to_string()));
    let mut choice = |name, value: Option<String>| parameters.extend(value.map(|value| (name, value)));
    choice("model", (config.model != default.model).then(|| named(config.model)));
    choice("obliquity", (config.obliquity != default.obliquity).then(|| named(config.obliquity)));
    choice("conserve_energy", config.conserve_energy.map(|conserves| conserves.to_string()));
    choice("shadowing", config.shadowing.then(|| "true".to_owned()));
    choice("transmission", (config.transmission != default.transmission).then(|| named(config.transmission)));
    parameters
}

/// Whether the method is `stam` in the form of GPU Gems, the only reader of the options `gems_…`.
fn is_gems(settings: &Settings) -> bool {
    settings.method == MethodKind::Stam && settings.options.stam_form == StamForm::Gems
}

/// The method, and names and values of the command's options for it. Options with default values and options that the
/// method ignores, which the command refuses, are left out.
fn method_options(settings: &Settings) -> Vec<(&'static str, String)> {
    let (options, default) = (&settings.options, MethodOptions::default());
    let supported = settings.method.options();
    let mut named_values = vec![("method", settings.method.name().to_owned())];
    // `field` is the name in `MethodOptions`, `option` that of the command. `value` is `None` for a default.
    let mut add = |field: &'static str, option: &'static str, value: Option<String>| {
        if supported.contains(&field) && (is_gems(settings) || !field.starts_with("gems_")) {
            named_values.extend(value.map(|value| (option, value)));
        }
    };
    let number = |value: f64, default: f64| (value != default).then(|| value.to_string());
    add("lambda_step_nm", "lambda_step", number(options.lambda_step_nm, default.lambda_step_nm));
    add("terms", "terms", options.terms.map(|terms| terms.to_string()));
    add("neighbourhood", "neighbourhood", options.neighbourhood.map(|orders| orders.to_string()));
    add("series", "series", (options.series != default.series).then(|| named(options.series)));
    add("weighted", "weighted", (!options.weighted).then(|| "false".to_owned()));
    add("repeats", "repeats", options.repeats.map(Repeats::xy).map(|[x, y]| format!("{x},{y}")));
    add("period_um", "period_um", options.period_um.map(|period| period.to_string()));
    add("stam_form", "stam_form", (options.stam_form != default.stam_form).then(|| named(options.stam_form)));
    add("gems_sharpness", "gems_sharpness", number(options.gems_sharpness, default.gems_sharpness));
    let highlight = options.gems_highlight;
    add("gems_highlight", "gems_highlight", (highlight != default.gems_highlight).then(|| coordinates(highlight, ",")));
    add("resolution", "table_resolution", number(options.resolution, default.resolution));
    named_values
}

/// Name of an enum's value, as in JSON and on the command line.
fn named(value: impl Serialize) -> String {
    serde_json::to_value(value).as_ref().map(plain).unwrap_or_default()
}

/// Text of a JSON value, without the quotes of strings and the `.0` of whole numbers.
fn plain(value: &Value) -> String {
    match (value.as_str(), value.as_f64()) {
        (Some(name), _) => name.to_owned(),
        (None, Some(number)) => number.to_string(),
        (None, None) => value.to_string(),
    }
}

/// Three numbers as text, separated by `between`.
fn coordinates(numbers: [f64; 3], between: &str) -> String {
    numbers.map(|number| number.to_string()).join(between)
}

/// A word of a shell command, in single quotes unless the shell gives no meaning to any of its characters.
fn quoted(word: &str) -> String {
    let is_safe = |c: char| c.is_ascii_alphanumeric() || "_-+.,/=@%".contains(c);
    if !word.is_empty() && word.chars().all(is_safe) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A value escaped for an XML attribute.
fn escaped(value: &str) -> String {
    value.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(json: &str) -> Settings {
        Settings::from_json(json).unwrap()
    }

    #[test]
    fn a_command_has_the_options_that_differ_from_the_defaults() {
        let command = |json: &str| command(&settings(json), (384, 256), 1);
        // The default index is 1.56, that of keratin.
        let plain = command("{}");
        assert!(plain.starts_with("sunbeam render -o picture.exr --png picture.png --size 384x256 --exposure 2"));
        assert!(plain.contains("--preset xenopeltis --eta 1.56 --conserve-energy false --method table --resolution 2"));
        assert!(!plain.contains("coherence") && !plain.contains("blend"));
        let file = command(
            r#"{"surface": {"filename": "my scan's.gsf", "level": "quadratic", "coherence_length": 30,
                "conserve_energy": true},
                "shape": "sphere", "pigment": "mix", "share": 0.25, "ground": false, "rotation_deg": -90}"#,
        );
        for words in [
            r"--height-field 'my scan'\''s.gsf'",
            "--level quadratic",
            "--coherence-length 30",
            "--conserve-energy true",
            "--shape sphere",
            "--blend mix --share 0.25",
            "--ground false",
            "--rotation -90",
        ] {
            assert!(file.contains(words), "{words} in {file}");
        }
        let film = command(r#"{"surface": {"eta": 1.5, "transmission": "film"}, "pigment": "mix"}"#);
        assert!(film.contains("--eta 1.5") && film.contains("--transmission film") && !film.contains("blend"));
        let flss = command(r#"{"method": "flss", "options": {"lambda_step_nm": 10, "weighted": false}}"#);
        assert!(flss.contains("--method flss --lambda-step 10") && !flss.contains("weighted"));
        // FLSS has only this tiling and model (`Settings::config`).
        assert!(flss.contains("--tiling periodic") && flss.contains("--model patch"));
        let stam = |options: &str| {
            command(&format!(r#"{{"surface": {{"obliquity": "unit"}}, "method": "stam", "options": {options}}}"#))
        };
        let spacing = stam(r#"{"gems_sharpness": 20}"#);
        assert!(spacing.contains("--obliquity unit") && !spacing.contains("gems"));
        let gems = stam(r#"{"stam_form": "gems", "gems_sharpness": 20}"#);
        assert!(gems.contains("--stam-form gems --gems-sharpness 20") && !gems.contains("obliquity"));
    }

    #[test]
    fn a_scene_has_the_relief_and_names_the_command_that_writes_the_mesh() {
        let scene = xml(&settings(r#"{"surface": {"filename": "a<b&c.gsf"}, "rotation_deg": 5}"#), (8, 8));
        assert!(scene.contains(r#"<string name="filename" value="a&lt;b&amp;c.gsf"/>"#));
        assert!(scene.contains("sunbeam snake -o snake.ply") && scene.contains("resolution 2,"));
        let comment = scene.split("<!--").nth(1).and_then(|rest| rest.split("-->").next()).unwrap();
        assert!(!comment.contains("--"));
        assert!(scene.contains(r#"<float name="rotation" value="5"/>"#));
        assert!(scene.contains(r#"<boolean name="conserve_energy" value="false"/>"#));
        let sphere = xml(&settings(r#"{"shape": "sphere", "method": "flss"}"#), (8, 8));
        assert!(sphere.contains(r#"<shape type="sphere">"#) && sphere.contains("the method flss"));
        assert!(!sphere.contains("sunbeam snake"));
        let film = xml(&settings(r#"{"surface": {"eta": 1.5, "transmission": "film"}}"#), (8, 8));
        assert!(film.contains(r#"<string name="transmission" value="film"/>"#));
        assert!(!film.contains("twosided") && !film.contains("diffuse_reflectance"));
    }
}
