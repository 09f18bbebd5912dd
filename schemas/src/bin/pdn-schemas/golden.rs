//! The golden vectors: every message, every variant, absent and present optionals, empty and long lists, and
//! numbers at the edges of their types. Each is written in both formats.

mod configs;
mod events;
mod replies;

use crate::files::Files;
use pdn_schemas::codec::{Format, Message, encode};

/// Adds `<Message>-<case>.bin` and `.json` for every case.
pub fn add_vectors(files: &mut Files) {
    let mut vectors = Vectors { files };
    events::add(&mut vectors);
    configs::add(&mut vectors);
    replies::add(&mut vectors);
}

struct Vectors<'a> {
    files: &'a mut Files,
}

impl Vectors<'_> {
    fn add<T: Message>(&mut self, case: &str, message: &T) {
        for (format, extension) in [(Format::Bincode, "bin"), (Format::Json, "json")] {
            let bytes = encode(message, format).expect("a golden vector can be written");
            self.files.add(format!("schemas/generated/golden/{}-{case}.{extension}", T::NAME), bytes);
        }
    }
}

/// Doubles that are easily lost: signed zero, the least subnormal, the greatest, and neighbours of round
/// numbers.
const EDGES: [f64; 8] =
    [-0.0, 5e-324, f64::MAX, f64::MIN, f64::MIN_POSITIVE, 0.1 + 0.2, 1.0 - f64::EPSILON / 2.0, 1e308];

/// Numbers of one and of several digits around where exponents begin, for 32 and for 64 bits.
fn spellings() -> [f64; 36] {
    let exponents = [-8, -7, -6, -5, -4, -3, 11, 12, 13, 14, 15, 16];
    let significands = ["1", "-1.25", "9.999999"];
    std::array::from_fn(|i| {
        format!("{}e{}", significands[i % 3], exponents[i / 3]).parse().expect("a number")
    })
}

/// An array of edges.
fn edges<const N: usize>() -> [f64; N] {
    std::array::from_fn(|index| EDGES[index % EDGES.len()])
}

/// An array of different ordinary numbers.
fn ordinary<const N: usize>(scale: f64) -> [f64; N] {
    let mut value = 0.0;
    std::array::from_fn(|_| {
        value += 1.0;
        value * scale
    })
}
