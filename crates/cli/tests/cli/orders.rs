//! `sunbeam orders` on bodies that transmit.

use crate::support::{run, succeeded};
use serde_json::Value;

/// The answer of `sunbeam orders --json` for a shallow sinusoid in glass.
fn orders(arguments: &[&str]) -> Value {
    let relief = ["orders", "--json", "--preset", "sinusoidal", "--period", "2.5", "--height", "0.1", "--eta", "1.5"];
    serde_json::from_str(&succeeded(run(&[&relief[..], arguments].concat(), ""))).unwrap()
}

fn number(order: &Value, name: &str) -> f64 {
    order[name].as_f64().unwrap()
}

#[test]
fn both_theories_agree_on_both_sides_of_shallow_reliefs() {
    /// Slopes are up to 7°. The small-slope factor errs by about their square, 1.6 %, of an order's power, up to 0.96.
    const ABSOLUTE: f64 = 1e-2;
    for transmission in ["film", "interface"] {
        for theta in ["0", "35"] {
            let arguments = ["--transmission", transmission, "--theta-i", theta];
            let scalar = orders(&arguments);
            let rigorous = orders(&[&arguments[..], &["--theory", "rigorous"]].concat());
            let (found, expected) = (scalar["orders"].as_array().unwrap(), rigorous["orders"].as_array().unwrap());
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(expected) {
                assert_eq!((&found["side"], &found["order"]), (&expected["side"], &expected["order"]));
                for state in ["te", "tm", "mean"] {
                    let off = (number(found, state) - number(expected, state)).abs();
                    assert!(off < ABSOLUTE, "{transmission} {theta} {state}: {found} {expected}");
                }
            }
            let sides: Vec<_> = expected.iter().map(|order| order["side"].as_str().unwrap()).collect();
            assert!(sides.contains(&"above") && sides.contains(&"below"));
            assert_eq!(sides.contains(&"trapped"), transmission == "film");
        }
    }
}

#[test]
fn polarised_efficiencies_are_continuous_at_an_order_along_the_normal() {
    /// An efficiency changes by about 0.2 % over 1 nm, while TE and TM of the reflected order differ by 8 %.
    const RELATIVE: f64 = 1e-2;
    for transmission in ["film", "interface"] {
        // At 1250 nm and 30° order 1 leaves along the normal.
        let [along, beside] = ["1250", "1249"]
            .map(|nm| orders(&["--transmission", transmission, "--theta-i", "30", "--wavelength", nm]))
            .map(|solved| solved["orders"].as_array().unwrap().clone())
            .map(|orders| orders.into_iter().filter(|order| order["order"] == 1).collect::<Vec<_>>());
        assert_eq!((along.len(), beside.len()), (2, 2), "above and below");
        for (along, beside) in along.iter().zip(&beside) {
            for state in ["te", "tm"] {
                let ratio = number(along, state) / number(beside, state);
                assert!((ratio - 1.0).abs() < RELATIVE, "{transmission} {state}: {along} {beside}");
            }
        }
    }
}

#[test]
fn orders_and_the_rest_are_all_light() {
    /// The solver's accepted error.
    const BALANCE: f64 = 1e-3;
    for transmission in ["film", "interface"] {
        let solved =
            orders(&["--transmission", transmission, "--theory", "rigorous", "--phi-i", "30", "--theta-i", "50"]);
        for (state, name) in ["te", "tm"].into_iter().enumerate() {
            let sum: f64 = solved["orders"].as_array().unwrap().iter().map(|order| number(order, name)).sum();
            let rest = solved["absorbed"][state].as_f64().unwrap();
            assert!((sum + rest - 1.0).abs() < BALANCE, "{transmission} {name}: {sum} {rest}");
            // The flat side of a film reflects some percent.
            assert_eq!(rest > 0.01, transmission == "film", "{transmission} {name}: {rest}");
        }
    }
}
