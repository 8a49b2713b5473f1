//! What is accepted ends: builds are estimated before they are begun, and refused beyond a limit.

use std::time::Instant;
use sunbeam::config::SurfaceConfig;
use sunbeam::reflectance::{Options, Surface};

#[test]
fn calibrate() {
    for json in std::env::var("CAL").unwrap_or_default().split(';') {
        if json.is_empty() { continue; }
        let config = SurfaceConfig::from_json(json).unwrap();
        let field = config.height_field().unwrap();
        let options = Options { build_limit: 1e6, ..config.options() };
        let demand = options.demand(&field);
        let start = Instant::now();
        let estimate = demand.estimate();
        let us = start.elapsed().as_secs_f64() * 1e6;
        let table = sunbeam::table::BuildDemand { purpose: sunbeam::table::Purpose::Table, ..demand.clone() }.estimate();
        let start = Instant::now();
        let surface = Surface::new(&field, &options).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let r = surface.report();
        println!("{json}\n   size {:?} knots {} nodes {} table bytes {} est {:.0} | table est {:.2} s, {:.2} | total est {:.2} s, {:.2} | peak est {:.3} GB | took {us:.0} us err {:.1e}",
            field.size(), r.table.kappa_knots, r.table.nodes, r.table.bytes, demand.table_bytes(), table.seconds, r.table.build_seconds, estimate.seconds, seconds, estimate.bytes/1e9, r.table.relative_error);
    }
}
