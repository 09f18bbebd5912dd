//! Bytes that are nearly messages: every decoder answers them, without a panic and in time.
//!
//! `PDN_FUZZ_INPUTS` is how many are tried; the same number tries the same ones.

use pdn_schemas::codec::{
    Format, Message, MessageVisitor, decode, decode_head, encode, visit_messages, visit_records,
};
use std::path::Path;
use std::time::{Duration, Instant};

/// A message of 4 MiB may take some milliseconds; these are a few kB.
const SLOWEST: Duration = Duration::from_secs(2);

struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }
}

/// Changes bytes in one of the ways in which senders, cables and enemies do.
fn spoil(bytes: &mut Vec<u8>, others: &[Vec<u8>], chance: &mut Chance) {
    const NUMBERS: [u64; 8] = [0, 1, 255, 65_536, u32::MAX as u64, 1 << 40, u64::MAX - 1, u64::MAX];
    let at = chance.below(bytes.len() + 1);
    match chance.below(9) {
        0 if at < bytes.len() => bytes[at] ^= 1 << chance.below(8),
        1 => bytes.truncate(at),
        2 => bytes.insert(at, chance.next() as u8),
        3 if at < bytes.len() => drop(bytes.remove(at)),
        4 if at + 8 <= bytes.len() => {
            bytes[at..at + 8].copy_from_slice(&NUMBERS[chance.below(8)].to_le_bytes());
        }
        5 => {
            let other = &others[chance.below(others.len())];
            let from = chance.below(other.len() + 1);
            bytes.splice(at.., other[from..].iter().copied());
        }
        6 => {
            let end = (at + chance.below(64)).min(bytes.len());
            let copy = bytes[at..end].to_vec();
            bytes.splice(at..at, copy);
        }
        7 => {
            let nested = [b"[".as_slice(), b"{\"a\":"][chance.below(2)].repeat(1 + chance.below(2000));
            bytes.splice(at..at, nested);
        }
        _ => {
            const WORDS: [&str; 10] =
                ["null", "-", "1e999", "NaN", "\"", "\\ud800", ",", "}", "\u{0}", "\"seq\":1,"];
            bytes.splice(at..at, WORDS[chance.below(10)].bytes());
        }
    }
}

struct Attack {
    seeds: Vec<(String, Format, Vec<u8>)>,
    each: usize,
    tried: u64,
    taken: u64,
    slowest: Duration,
}

impl MessageVisitor for Attack {
    fn visit<T: Message>(&mut self) {
        let mut chance =
            Chance(T::NAME.bytes().fold(7, |sum: u64, byte| sum.wrapping_mul(31) ^ u64::from(byte)));
        for format in [Format::Json, Format::Bincode] {
            let of = |wanted: bool| {
                let seeds = self
                    .seeds
                    .iter()
                    .filter(move |(name, seed, _)| *seed == format && (!wanted || name == T::NAME));
                seeds.map(|(_, _, bytes)| bytes.clone()).collect::<Vec<_>>()
            };
            let (own, all) = (of(true), of(false));
            for _ in 0..self.each.div_ceil(2) {
                let from = if own.is_empty() { &all } else { &own };
                let mut bytes = from[chance.below(from.len())].clone();
                (0..1 + chance.below(4)).for_each(|_| spoil(&mut bytes, &all, &mut chance));
                let start = Instant::now();
                let _ = decode_head(&bytes, format);
                if let Ok(message) = decode::<T>(&bytes, format) {
                    self.taken += 1;
                    // What is taken can be told again, unless a number is none in JSON or it is too large for
                    // its place.
                    let _ = encode(&message, Format::Bincode);
                    let _ = encode(&message, Format::Json);
                }
                let took = start.elapsed();
                assert!(took < SLOWEST, "{} took {took:?}: {:?}", T::NAME, &bytes[..bytes.len().min(200)]);
                self.slowest = self.slowest.max(took);
                self.tried += 1;
            }
        }
    }
}

struct Count(usize);

impl MessageVisitor for Count {
    fn visit<T: Message>(&mut self) {
        self.0 += 1;
    }
}

#[test]
fn no_decoder_fails_on_what_is_nearly_a_message() {
    let inputs: usize =
        std::env::var("PDN_FUZZ_INPUTS").map_or(200_000, |inputs| inputs.parse().expect("a number"));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("generated/golden");
    let mut seeds = Vec::new();
    let mut files: Vec<_> =
        folder.read_dir().expect("golden vectors").flatten().map(|entry| entry.path()).collect();
    files.sort();
    for path in files {
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        let format = if name.ends_with(".json") { Format::Json } else { Format::Bincode };
        let message = name.split('-').next().unwrap_or_default().to_owned();
        seeds.push((message, format, std::fs::read(&path).expect("a golden vector")));
    }
    assert!(seeds.len() > 100);
    let mut kinds = Count(0);
    visit_messages(&mut kinds);
    visit_records(&mut kinds);
    let mut attack =
        Attack { seeds, each: inputs.div_ceil(kinds.0), tried: 0, taken: 0, slowest: Duration::ZERO };
    visit_messages(&mut attack);
    visit_records(&mut attack);
    println!(
        "{} malformed inputs to {} decoders in two formats: no panic; {} were messages after all; slowest \
         {:?}",
        attack.tried, kinds.0, attack.taken, attack.slowest
    );
    assert!(attack.taken > 0 && attack.taken < attack.tried, "{} of {}", attack.taken, attack.tried);
}
