//! The table of formats in the documentation equals the descriptions of the readers.
//!
//! `SUNBEAM_WRITE_FORMATS=1 cargo test -p sunbeam-height-field --test formats_page` writes the table.

use std::path::Path;
use sunbeam_height_field::{FORMATS, READABLE};

const START: &str = "<!-- formats: made by crates/height_field/tests/formats_page.rs -->\n";
const END: &str = "<!-- /formats -->\n";

fn table() -> String {
    let head = ["extension", "contents", "unit", "pixel size", "first row", "channel", "holes", "not read"];
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut table = line(&head.map(str::to_owned)) + &line(&head.map(|_| "---".to_owned()));
    for format in FORMATS {
        let name = |extension: &&str| {
            if *extension == "000" { "`.000` … `.999`".to_owned() } else { format!("`.{extension}`") }
        };
        let extensions = format.extensions.iter().map(name).collect::<Vec<_>>().join(", ");
        let cells = [
            format.contents,
            format.unit,
            format.size,
            format.first_row,
            format.channels,
            format.holes,
            format.not_read,
        ];
        let dash = |cell: &str| if cell.is_empty() { "–".to_owned() } else { cell.to_owned() };
        table += &line(&std::iter::once(extensions).chain(cells.map(dash)).collect::<Vec<_>>());
    }
    table
}

#[test]
fn page_has_the_table_of_the_readers() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/height-fields.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let start = page.find(START).expect("the mark before the table") + START.len();
    let end = page.find(END).expect("the mark behind the table");
    if std::env::var_os("SUNBEAM_WRITE_FORMATS").is_some() {
        std::fs::write(&path, format!("{}{}{}", &page[..start], table(), &page[end..])).unwrap();
        return;
    }
    assert_eq!(&page[start..end], table(), "write the table with SUNBEAM_WRITE_FORMATS=1");
}

#[test]
fn messages_list_every_extension() {
    for extension in FORMATS.iter().flat_map(|format| format.extensions) {
        assert!(READABLE.split(", ").any(|listed| listed.starts_with(&format!(".{extension}"))), "{extension}");
    }
}
