//! Tests of the snake's mesh and pigment. Words such as scale, wall, foot and free edge are those of lattice.rs.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::lattice::{Lattice, Side};
use super::*;

/// Number of vertices of the default mesh.
const VERTICES: usize = 10_933;
/// Number of triangles of the default mesh.
const FACES: usize = 21_573;
/// Number of vertices of Single 2014's scan of a snake, with which the default mesh agrees within a tenth.
const VERTICES_OF_THE_SCAN: usize = 11_696;
/// Number of triangles of the same scan.
const FACES_OF_THE_SCAN: usize = 22_950;
/// Rounding error of unit vectors in single precision.
const UNIT_TOLERANCE: f32 = 1e-6;

fn default_mesh() -> SnakeMesh {
    SnakeMesh::build(&SnakeOptions::default()).unwrap()
}

/// Positions in cm and texture coordinates of the corners of a triangle.
fn corners(mesh: &SnakeMesh, triangle: [u32; 3]) -> ([DVec3; 3], [DVec2; 3]) {
    (
        triangle.map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3()),
        triangle.map(|i| Vec2::from(mesh.uvs[i as usize]).as_dvec2()),
    )
}

/// Normal of a triangle, outward; its length is twice the area.
fn geometric_normal([p0, p1, p2]: [DVec3; 3]) -> DVec3 {
    (p1 - p0).cross(p2 - p0)
}

/// Derivatives of the position by the texture coordinates u and v on a triangle.
fn dp_du_and_dv([p0, p1, p2]: [DVec3; 3], [uv0, uv1, uv2]: [DVec2; 3]) -> (DVec3, DVec3) {
    let (dp1, dp2) = (p1 - p0, p2 - p0);
    let (duv1, duv2) = (uv1 - uv0, uv2 - uv0);
    let determinant = duv1.perp_dot(duv2);
    ((dp1 * duv2.y - dp2 * duv1.y) / determinant, (dp2 * duv1.x - dp1 * duv2.x) / determinant)
}

/// Whether a triangle is part of a wall: it deviates by more than 30° from its normals, which are those of its scale.
fn is_wall(mesh: &SnakeMesh, triangle: [u32; 3]) -> bool {
    let shading: DVec3 = triangle.iter().map(|i| Vec3::from(mesh.normals[*i as usize]).as_dvec3()).sum();
    geometric_normal(corners(mesh, triangle).0).angle_between(shading).to_degrees() > 30.0
}

/// The value below which the fraction `q` of the values lies. Sorts the values.
fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(q * (values.len() - 1) as f64) as usize]
}

/// The scales (i, j) of the sheet (lattice.rs), those on its rim included.
fn scales(lattice: &Lattice) -> impl Iterator<Item = (i64, i64)> {
    let (along, around) = (lattice.rows_along, lattice.rows_around);
    (0..=along).flat_map(move |i| (0..=around).map(move |j| (i, j))).filter(|(i, j)| (i + j) % 2 == 0)
}

#[test]
fn default_counts_are_near_those_of_the_scan() {
    let mesh = default_mesh();
    for count in [mesh.positions.len(), mesh.normals.len(), mesh.tangents.len(), mesh.uvs.len()] {
        assert_eq!(count, VERTICES);
    }
    assert_eq!(mesh.triangles.len(), FACES);
    assert!(VERTICES.abs_diff(VERTICES_OF_THE_SCAN) < VERTICES_OF_THE_SCAN / 10);
    assert!(FACES.abs_diff(FACES_OF_THE_SCAN) < FACES_OF_THE_SCAN / 10);
}

#[test]
fn the_mesh_is_one_consistently_oriented_sheet() {
    let mesh = default_mesh();
    let mut used = vec![false; mesh.positions.len()];
    let mut directed = HashMap::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            used[triangle[k] as usize] = true;
            *directed.entry((triangle[k], triangle[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    assert!(used.iter().all(|&u| u));
    // Each directed edge once: neighbours agree on the side that is outside.
    assert!(directed.values().all(|&count| count == 1));
    // End of each edge that only one triangle has, by its start.
    let rim: HashMap<u32, u32> = directed.keys().copied().filter(|&(a, b)| !directed.contains_key(&(b, a))).collect();
    // The sheet is 27 half scales long and 17 wide, so its rim cuts through 17 + 27 scales. It has six edges (twice
    // `half_cells`) along each of these, and one down the wall at each of 27 tips on it.
    assert_eq!(rim.len(), 6 * (17 + 27) + 27);
    let (&start, _) = rim.iter().next().unwrap();
    let mut rim_loop = vec![start];
    while rim[rim_loop.last().unwrap()] != start {
        rim_loop.push(rim[rim_loop.last().unwrap()]);
        assert!(rim_loop.len() <= rim.len());
    }
    assert_eq!(rim_loop.len(), rim.len(), "the rim is one loop");
    let edges = (directed.len() + rim.len()) / 2;
    assert_eq!(mesh.positions.len() + mesh.triangles.len() - edges, 1, "Euler characteristic of a disk");
}

#[test]
fn the_texture_is_covered_once_without_gaps() {
    for factor in [1.0, 2.5] {
        let options = SnakeOptions { variation: 1.0, ..SnakeOptions::default() }.with_resolution(factor);
        let mesh = SnakeMesh::build(&options).unwrap();
        let areas = mesh.triangles.iter().map(|triangle| {
            let (_, uv) = corners(&mesh, *triangle);
            0.5 * (uv[1] - uv[0]).perp_dot(uv[2] - uv[0])
        });
        let (least, sum) = areas.fold((f64::MAX, 0.0), |(least, sum), area| (area.min(least), sum + area));
        // No triangle is turned over, and all fill the unit square up to rounding, 1e-7 for each coordinate.
        assert!(least > 0.0 && (sum - 1.0).abs() < 1e-6, "least {least}, sum {sum}");
    }
}

#[test]
fn scales_begin_under_the_edges_of_the_scales_before() {
    let options = SnakeOptions { variation: 1.0, ..SnakeOptions::default() };
    let surface = super::mesh::Surface::new(&options);
    let lattice = &surface.scales.lattice;
    let mut highest: f64 = 0.0;
    // The last scales have none behind them.
    for (i, j) in scales(lattice).filter(|&(i, _)| i < lattice.rows_along) {
        for side in [Side::Left, Side::Right] {
            let below = (i + 1, if side == Side::Left { j - 1 } else { j + 1 });
            for t in 0..=8 {
                let t = f64::from(t) / 8.0;
                let (edge, foot) = (lattice.free_edge((i, j), side, t), lattice.foot((i, j), side, t));
                // The foot lies on the skin, up to rounding of heights of about 0.03 cm.
                assert!(surface.scales.height_cm(below, foot).abs() < 1e-12);
                let step = surface.scales.height_cm((i, j), edge);
                assert!(step > -1e-12, "scale {i}, {j}: the edge lies {step} cm over the skin");
                highest = highest.max(step);
            }
        }
    }
    assert!(highest > 0.01 && highest < 0.05, "highest step {highest} cm");
}

#[test]
fn the_visible_scale_agrees_with_the_mesh() {
    let options = SnakeOptions { variation: 1.0, ..SnakeOptions::default() };
    let lattice = Lattice::new(&options);
    for scale in scales(&lattice) {
        // Positions in the scale's patch, from 0 to 1.
        for (x, y) in [(0.02, 0.02), (0.02, 0.5), (0.5, 0.02), (0.5, 0.5), (0.98, 0.5), (0.5, 0.98), (0.98, 0.98)] {
            let point = super::patch::Patch::new(&lattice, scale).point(x, y);
            let size = DVec2::new(lattice.rows_along as f64, lattice.rows_around as f64);
            if point.cmpge(DVec2::ZERO).all() && point.cmple(size).all() {
                assert_eq!(lattice.visible_scale(point), scale, "at {x}, {y}");
            }
        }
    }
}

#[test]
fn frames_are_orthonormal_and_outward() {
    let mesh = default_mesh();
    let options = SnakeOptions::default();
    // The top of the back is at half scale 8 of the 17 around the body.
    let body = super::body::Body::new(&options, 8.0 / 17.0);
    for (i, uv) in mesh.uvs.iter().enumerate() {
        let (n, t) = (Vec3::from(mesh.normals[i]), Vec3::from(mesh.tangents[i]));
        assert!((n.length() - 1.0).abs() < UNIT_TOLERANCE && (t.length() - 1.0).abs() < UNIT_TOLERANCE);
        assert!(n.dot(t).abs() < UNIT_TOLERANCE);
        // The centreline deviates from +x by at most 0.5 rad (`bend_rad`), which has the cosine 0.88. Scales tilt
        // tangents further.
        assert!(t.x > 0.3, "tangent {t} at vertex {i}");
        let (_, skin) = body.point(uv[0].into(), uv[1].into());
        // Scales tilt normals from those of the smooth skin by less than 37°, the angle of this cosine.
        assert!(n.as_dvec3().dot(skin) > 0.8, "vertex {i} looks inward, or along the skin");
    }
}

#[test]
fn triangles_are_not_degenerate_and_keep_the_orientation_of_the_texture() {
    for factor in [1.0, 2.5] {
        let mesh = SnakeMesh::build(&SnakeOptions::default().with_resolution(factor)).unwrap();
        let mut areas = Vec::new();
        for triangle in &mesh.triangles {
            let (p, uv) = corners(&mesh, *triangle);
            let normal = geometric_normal(p);
            areas.push(0.5 * normal.length());
            assert!((uv[1] - uv[0]).perp_dot(uv[2] - uv[0]) > 0.0, "u × v is mirrored, {factor}");
            for i in triangle {
                let shading = Vec3::from(mesh.normals[*i as usize]).as_dvec3();
                assert!(shading.dot(normal) > 0.0, "shading normal behind its triangle, {factor}");
            }
        }
        let middle = quantile(&mut areas, 0.5);
        // The areas are sorted. The smallest triangles lie where walls begin, at the flanks of scales.
        assert!(areas[0] > 0.01 * middle, "slivers: {} against {middle}", areas[0]);
    }
}

/// Largest accepted angle between the stored tangents and Mitsuba's, which follow from texture coordinates: the median
/// over corners on scales. The default snake has 0.26°.
const TANGENT_MEDIAN_DEG: f64 = 0.6;
/// Largest accepted 90th percentile of these angles. The default snake has 0.82°.
const TANGENT_P90_DEG: f64 = 2.0;
/// Largest accepted maximum of these angles. The default snake has 1.9°.
const TANGENT_MAX_DEG: f64 = 7.0;
/// Largest accepted median of the angles at corners on walls, whose shading normals are those of the scales.
const TANGENT_WALL_DEG: f64 = 12.0;

#[test]
fn the_tangent_is_the_texture_derivative() {
    // Mitsuba's tangent: dp_du of the triangle, made orthogonal to the interpolated normal.
    let mesh = default_mesh();
    let mut angles = Vec::new();
    let mut walls = Vec::new();
    for triangle in &mesh.triangles {
        let (p, uv) = corners(&mesh, *triangle);
        let (dp_du, dp_dv) = dp_du_and_dv(p, uv);
        for i in triangle {
            let n = Vec3::from(mesh.normals[*i as usize]).as_dvec3();
            let t = Vec3::from(mesh.tangents[*i as usize]).as_dvec3();
            let shading = dp_du.reject_from_normalized(n);
            let angle = shading.angle_between(t).to_degrees();
            if is_wall(&mesh, *triangle) {
                walls.push(angle);
                continue;
            }
            angles.push(angle);
            assert!(n.cross(t).dot(dp_dv) > 0.0, "bitangent against v");
        }
    }
    let (median, p90) = (quantile(&mut angles, 0.5), quantile(&mut angles, 0.9));
    let largest = quantile(&mut angles, 1.0);
    println!("tangent against dp_du: median {median:.3}°, 90 % {p90:.3}°, largest {largest:.3}°");
    assert!(median < TANGENT_MEDIAN_DEG, "median {median}");
    assert!(p90 < TANGENT_P90_DEG, "90 % {p90}");
    assert!(largest < TANGENT_MAX_DEG, "largest {largest}");
    let wall = quantile(&mut walls, 0.5);
    assert!(wall < TANGENT_WALL_DEG, "walls {wall}");
}

#[test]
fn textures_are_hardly_stretched() {
    // Ratios of the sides of a texel on the skin, for a texture twice as wide as high.
    let mesh = default_mesh();
    let mut ratios = Vec::new();
    for triangle in mesh.triangles.iter().filter(|triangle| !is_wall(&mesh, **triangle)) {
        let (p, uv) = corners(&mesh, *triangle);
        let (dp_du, dp_dv) = dp_du_and_dv(p, uv);
        ratios.push(dp_du.length() / (2.0 * dp_dv.length()));
    }
    let (low, middle, high) = (quantile(&mut ratios, 0.01), quantile(&mut ratios, 0.5), quantile(&mut ratios, 0.99));
    // The default snake has the percentiles 0.66 (1 %), 1.01 (50 %) and 1.36 (99 %).
    println!("texel aspect: 1 % {low:.2}, median {middle:.2}, 99 % {high:.2}");
    assert!((middle - 1.0).abs() < 0.1 && low > 0.5 && high < 1.6, "{low} {middle} {high}");
}

#[test]
fn the_snake_lies_on_the_ground_and_has_its_size() {
    let mesh = default_mesh();
    let (low, high) =
        mesh.positions.iter().fold((f32::MAX, f32::MIN), |(low, high), p| (low.min(p[2]), high.max(p[2])));
    // The body is 1.2 cm · (0.92 + 0.70) = 1.94 cm high (`BACK` and `BELLY` of body.rs). Its middle is raised by
    // 0.25 cm, and scales add less than 0.1 cm.
    assert!(low > -0.1 && low < 0.2, "lowest point {low} cm");
    assert!(high > 1.9 && high < 2.6, "highest point {high} cm");
}

#[test]
fn resolution_scales_the_counts_and_keeps_the_shape() {
    let fine = SnakeMesh::build(&SnakeOptions::default().with_resolution(4.0)).unwrap();
    // A scale with n cells along each side has 2n² triangles, and 4n − 2 on its walls. From n = 6 to 24 their sum grows
    // to 0.83 · 16 times.
    let faces = fine.triangles.len() as f64 / (16 * FACES) as f64;
    assert!(faces > 0.8 && faces < 0.9, "{faces}");
    let area = |mesh: &SnakeMesh| -> f64 {
        mesh.triangles.iter().map(|t| 0.5 * geometric_normal(corners(mesh, *t).0).length()).sum()
    };
    let ratio = area(&fine) / area(&default_mesh());
    assert!((ratio - 1.0).abs() < 0.05, "areas {ratio}");
    // A factor that is no number changes nothing.
    let same = SnakeOptions::default().with_resolution(f64::NAN);
    assert_eq!(same, SnakeOptions::default());
}

#[test]
fn the_seed_decides_the_scales() {
    let other = SnakeOptions { seed: 2, ..SnakeOptions::default() };
    assert_eq!(default_mesh(), default_mesh());
    assert_ne!(default_mesh(), SnakeMesh::build(&other).unwrap());
    let plain = SnakeOptions { variation: 0.0, ..SnakeOptions::default() };
    let plain_other = SnakeOptions { seed: 2, ..plain.clone() };
    assert_eq!(SnakeMesh::build(&plain).unwrap(), SnakeMesh::build(&plain_other).unwrap());
}

#[test]
fn extreme_options_give_finite_meshes_and_bad_ones_are_refused() {
    let base = SnakeOptions { half_cells: 1, ..SnakeOptions::default() };
    for options in [
        SnakeOptions { relief: 0.0, ..base.clone() },
        SnakeOptions { relief: 3.0, keel: 3.0, variation: 1.0, ..base.clone() },
        SnakeOptions { bend_rad: 0.0, lift_cm: 0.0, ..base.clone() },
        SnakeOptions { rows_along: 400, rows_around: 100, ..base.clone() },
    ] {
        let mesh = SnakeMesh::build(&options).unwrap();
        for vectors in [&mesh.positions, &mesh.normals, &mesh.tangents] {
            assert!(vectors.iter().flatten().all(|x| x.is_finite()), "{options:?}");
        }
    }
    let refused = |options: SnakeOptions| SnakeMesh::build(&options).unwrap_err().to_string();
    assert!(refused(SnakeOptions { half_cells: 0, ..base.clone() }).contains("half_cells is 0"));
    assert!(refused(SnakeOptions { relief: f64::NAN, ..base.clone() }).contains("relief"));
    assert!(refused(SnakeOptions { bend_rad: 1.5, ..base.clone() }).contains("bend"));
    assert!(matches!(pigment_texture(&base, 0, 4), Err(SnakeError::Count { field: "width", .. })));
}

#[test]
fn ply_has_mitsubas_header_and_every_byte() {
    let mesh = default_mesh();
    let path = std::env::temp_dir().join(format!("sunbeam-snake-{}.ply", std::process::id()));
    mesh.write_ply(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let text = std::str::from_utf8(&bytes[..header]).unwrap();
    assert!(text.starts_with("ply\nformat binary_little_endian 1.0\n"), "{text}");
    for name in ["x", "nx", "u", "v", "tangent_x", "tangent_z"] {
        assert!(text.contains(&format!("property float {name}\n")), "{text}");
    }
    // A vertex has 11 floats of 4 bytes: position, normal, u, v and tangent. A triangle has a count byte and three i32.
    assert_eq!(bytes.len() - header, 44 * VERTICES + 13 * FACES);
    let float = |offset: usize| f32::from_le_bytes(bytes[header + offset..header + offset + 4].try_into().unwrap());
    // Position and tangent of the second vertex.
    assert_eq!([float(44), float(48), float(52)], mesh.positions[1]);
    assert_eq!([float(76), float(80), float(84)], mesh.tangents[1]);
    assert!(matches!(mesh.write_ply("/nonexistent/a.ply"), Err(SnakeError::Write { .. })));
}

#[test]
fn the_pigment_is_dark_and_its_png_is_read_back() {
    let texture = pigment_texture(&SnakeOptions::default(), 256, 128).unwrap();
    for pixel in &texture.pixels {
        // The documented range, 0.007 to 0.1, with a margin for the rounding to eight bits.
        let linear = sunbeam::colour::srgb_decode(pixel.map(|x| f64::from(x) / 255.0));
        assert!(linear.iter().all(|&x| x > 0.005 && x < 0.12), "{linear:?}");
    }
    let path = std::env::temp_dir().join(format!("sunbeam-pigment-{}.png", std::process::id()));
    texture.write_png(&path).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; 256 * 128 * 3];
    let frame = reader.next_frame(&mut pixels).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!((frame.width, frame.height), (256, 128));
    assert_eq!(pixels, texture.pixels.as_flattened());
}
