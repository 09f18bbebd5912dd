//! A bincode payload, read by the text of its layout.

use super::IMPLIED;
use super::layout::{Layout, Variant};
use crate::codec::CodecError;
use serde_json::{Map, Number, Value};
use std::collections::BTreeMap;

/// The value of a payload as JSON has it; every byte must belong to it.
///
/// # Errors
/// [`CodecError::Truncated`], [`CodecError::Trailing`], [`CodecError::Bincode`]. Takes no more memory than a
/// multiple of the payload, whatever lengths it claims.
pub(super) fn read(
    layouts: &BTreeMap<String, Layout>,
    message: &'static str,
    bytes: &[u8],
) -> Result<Value, CodecError> {
    let mut reader = Reader { layouts, message, bytes, read: 0 };
    let value = reader.named(message)?;
    if reader.read < bytes.len() {
        return Err(CodecError::Trailing { message, read: reader.read, bytes: bytes.len() });
    }
    Ok(value)
}

struct Reader<'a> {
    layouts: &'a BTreeMap<String, Layout>,
    message: &'static str,
    bytes: &'a [u8],
    read: usize,
}

impl<'a> Reader<'a> {
    fn value(&mut self, layout: &'a Layout) -> Result<Value, CodecError> {
        Ok(match layout {
            Layout::Bool => Value::Bool(self.bool()?),
            Layout::Unsigned(bytes) => Value::from(self.unsigned(*bytes)?),
            Layout::Signed(bytes) => Value::from(self.signed(*bytes)?),
            Layout::F32 => {
                let bits = self.unsigned(4)? as u32;
                self.number(f64::from(f32::from_bits(bits)))?
            }
            Layout::F64 => {
                let bits = self.unsigned(8)?;
                self.number(f64::from_bits(bits))?
            }
            Layout::Text => Value::String(self.text()?),
            Layout::Named(name) => self.named(name)?,
            Layout::Optional(inner) => {
                if self.bool()? {
                    self.value(inner)?
                } else {
                    Value::Null
                }
            }
            Layout::List(inner) => {
                let length = self.length()?;
                self.values(std::iter::repeat_n(&**inner, length))?
            }
            Layout::Array(inner, length) => self.values(std::iter::repeat_n(&**inner, *length))?,
            Layout::Tuple(parts) => self.values(parts.iter())?,
            Layout::Map(inner) => {
                let entries = (0..self.length()?).map(|_| Ok((self.text()?, self.value(inner)?)));
                Value::Object(entries.collect::<Result<Map<String, Value>, CodecError>>()?)
            }
            Layout::Struct(fields) => {
                let fields = fields.iter().map(|(name, field)| Ok((name.clone(), self.value(field)?)));
                Value::Object(fields.collect::<Result<Map<String, Value>, CodecError>>()?)
            }
            Layout::Enum(variants) => self.variant(variants)?,
        })
    }

    fn named(&mut self, name: &str) -> Result<Value, CodecError> {
        let layouts = self.layouts;
        let layout = layouts.get(name).ok_or_else(|| self.damaged(&format!("there was no {name}")))?;
        let mut value = self.value(layout)?;
        if let Value::Object(fields) = &mut value {
            for (_, field, meant) in IMPLIED.iter().filter(|(container, ..)| *container == name) {
                fields.entry(*field).or_insert_with(|| Value::from(*meant));
            }
        }
        Ok(value)
    }

    fn values(&mut self, layouts: impl Iterator<Item = &'a Layout>) -> Result<Value, CodecError> {
        let values: Result<Vec<Value>, CodecError> = layouts.map(|layout| self.value(layout)).collect();
        Ok(Value::Array(values?))
    }

    fn variant(&mut self, variants: &'a [Variant]) -> Result<Value, CodecError> {
        let tag = self.unsigned(4)?;
        let variant = variants.iter().find(|variant| u64::from(variant.tag) == tag);
        let variant = variant.ok_or_else(|| self.damaged(&format!("no variant has the tag {tag}")))?;
        Ok(match &variant.content {
            None => Value::String(variant.name.clone()),
            Some(content) => Value::Object(Map::from_iter([(variant.name.clone(), self.value(content)?)])),
        })
    }

    fn bool(&mut self) -> Result<bool, CodecError> {
        match self.unsigned(1)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(self.damaged(&format!("{other} is neither 0 nor 1"))),
        }
    }

    fn unsigned(&mut self, bytes: usize) -> Result<u64, CodecError> {
        let mut all = [0; 8];
        all[..bytes].copy_from_slice(self.take(bytes)?);
        Ok(u64::from_le_bytes(all))
    }

    fn signed(&mut self, bytes: usize) -> Result<i64, CodecError> {
        let unused_bits = 64 - 8 * bytes as u32;
        Ok((self.unsigned(bytes)? << unused_bits) as i64 >> unused_bits)
    }

    fn number(&self, value: f64) -> Result<Value, CodecError> {
        let number =
            Number::from_f64(value).ok_or_else(|| self.damaged(&format!("{value} is not finite")))?;
        Ok(Value::Number(number))
    }

    fn text(&mut self) -> Result<String, CodecError> {
        let length = self.length()?;
        let text = std::str::from_utf8(self.take(length)?);
        text.map(str::to_owned).map_err(|error| self.damaged(&error.to_string()))
    }

    /// A length that is claimed: no element takes less than a byte.
    fn length(&mut self) -> Result<usize, CodecError> {
        let claimed = self.unsigned(8)?;
        let left = self.bytes.len() - self.read;
        match usize::try_from(claimed) {
            Ok(length) if length <= left => Ok(length),
            _ => Err(CodecError::LyingLength { message: self.message, bytes: self.bytes.len(), limit: left }),
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], CodecError> {
        let left = &self.bytes[self.read..];
        if left.len() < count {
            let missing = count - left.len();
            return Err(CodecError::Truncated { message: self.message, bytes: self.bytes.len(), missing });
        }
        self.read += count;
        Ok(&left[..count])
    }

    fn damaged(&self, reason: &str) -> CodecError {
        CodecError::Bincode { message: self.message, reason: reason.to_owned() }
    }
}
