//! Every message and record, in both formats: the first byte says which. What is decoded is encoded again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pdn_schemas::codec::{Format, Message, MessageVisitor, decode, decode_head, encode};
use pdn_schemas::codec::{visit_messages, visit_records};

struct Decode<'a> {
    which: u8,
    number: u8,
    format: Format,
    bytes: &'a [u8],
}

impl MessageVisitor for Decode<'_> {
    fn visit<T: Message>(&mut self) {
        if self.number == self.which {
            if let Ok(message) = decode::<T>(self.bytes, self.format) {
                let _ = encode(&message, Format::Bincode);
                let _ = encode(&message, Format::Json);
            }
        }
        self.number += 1;
    }
}

fuzz_target!(|input: &[u8]| {
    let Some((&first, bytes)) = input.split_first() else { return };
    let format = if first & 1 == 0 { Format::Json } else { Format::Bincode };
    let _ = decode_head(bytes, format);
    let mut decode = Decode { which: first >> 1, number: 0, format, bytes };
    visit_messages(&mut decode);
    visit_records(&mut decode);
});
