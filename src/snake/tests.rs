use super::*;
#[test]
fn dump() {
    let Ok(dir) = std::env::var("SNAKE_DUMP") else { return };
    for f in [1.0, 4.0] {
        let m = SnakeMesh::build(&SnakeOptions::default().with_resolution(f)).unwrap();
        m.write_ply(format!("{dir}/snake{f}.ply")).unwrap();
    }
    pigment_texture(&SnakeOptions::default(), 1024, 512).unwrap().write_png(format!("{dir}/pigment.png")).unwrap();
}
