//! Finds the number that JSON cannot carry. `serde_json` writes an infinity or NaN as `null`, which a reader
//! would take for an absent optional.

use serde::ser::{
    Error, Impossible, Serialize, SerializeMap, SerializeSeq, SerializeStruct, SerializeStructVariant,
    SerializeTuple, Serializer,
};
use std::fmt;

/// The path of the first infinity or NaN as the error, `robot.covariance[7]` or the like.
pub fn check<T: Serialize>(value: &T) -> Result<(), String> {
    value.serialize(Walk).map_err(|Stray(path)| path.trim_start_matches('.').to_owned())
}

/// Where the number stands below the value that reports it.
#[derive(Debug)]
struct Stray(String);

impl Stray {
    fn below(self, step: impl fmt::Display) -> Stray {
        Stray(format!("{step}{}", self.0))
    }
}

impl fmt::Display for Stray {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Stray {}

impl Error for Stray {
    fn custom<T: fmt::Display>(reason: T) -> Stray {
        Stray(reason.to_string())
    }
}

/// A serializer that writes nothing.
struct Walk;

/// Counts the elements of a list that is being walked.
struct Elements(usize);

/// Remembers the variant around a struct.
struct Fields(String);

macro_rules! fine {
    ($($method:ident($kind:ty))+) => {
        $(fn $method(self, _: $kind) -> Result<(), Stray> { Ok(()) })+
    };
}

impl Serializer for Walk {
    type Ok = ();
    type Error = Stray;
    type SerializeSeq = Elements;
    type SerializeTuple = Elements;
    type SerializeTupleStruct = Impossible<(), Stray>;
    type SerializeTupleVariant = Impossible<(), Stray>;
    type SerializeMap = Fields;
    type SerializeStruct = Fields;
    type SerializeStructVariant = Fields;

    fine! {
        serialize_bool(bool) serialize_i8(i8) serialize_i16(i16) serialize_i32(i32) serialize_i64(i64)
        serialize_u8(u8) serialize_u16(u16) serialize_u32(u32) serialize_u64(u64) serialize_char(char)
        serialize_str(&str) serialize_bytes(&[u8]) serialize_unit_struct(&'static str)
    }

    fn serialize_f32(self, value: f32) -> Result<(), Stray> {
        self.serialize_f64(f64::from(value))
    }

    fn serialize_f64(self, value: f64) -> Result<(), Stray> {
        if value.is_finite() { Ok(()) } else { Err(Stray(String::new())) }
    }

    fn serialize_none(self) -> Result<(), Stray> {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Stray> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), Stray> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Result<(), Stray> {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), Stray> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Stray> {
        value.serialize(self).map_err(|stray| stray.below(format_args!(".{variant}")))
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Elements, Stray> {
        Ok(Elements(0))
    }

    fn serialize_tuple(self, _: usize) -> Result<Elements, Stray> {
        Ok(Elements(0))
    }

    fn serialize_tuple_struct(
        self,
        name: &'static str,
        _: usize,
    ) -> Result<Self::SerializeTupleStruct, Stray> {
        Err(Stray::custom(format_args!("{name}: no message has tuple structs")))
    }

    fn serialize_tuple_variant(
        self,
        name: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self::SerializeTupleVariant, Stray> {
        Err(Stray::custom(format_args!("{name}: no message has tuple variants")))
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Fields, Stray> {
        Ok(Fields(String::new()))
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Fields, Stray> {
        Ok(Fields(String::new()))
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Fields, Stray> {
        Ok(Fields(format!(".{variant}")))
    }
}

impl SerializeSeq for Elements {
    type Ok = ();
    type Error = Stray;

    fn serialize_element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stray> {
        let index = self.0;
        self.0 += 1;
        value.serialize(Walk).map_err(|stray| stray.below(format_args!("[{index}]")))
    }

    fn end(self) -> Result<(), Stray> {
        Ok(())
    }
}

impl SerializeTuple for Elements {
    type Ok = ();
    type Error = Stray;

    fn serialize_element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stray> {
        SerializeSeq::serialize_element(self, value)
    }

    fn end(self) -> Result<(), Stray> {
        Ok(())
    }
}

impl SerializeStruct for Fields {
    type Ok = ();
    type Error = Stray;

    fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Stray> {
        value.serialize(Walk).map_err(|stray| stray.below(format_args!("{}.{name}", self.0)))
    }

    fn end(self) -> Result<(), Stray> {
        Ok(())
    }
}

impl SerializeStructVariant for Fields {
    type Ok = ();
    type Error = Stray;

    fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Stray> {
        SerializeStruct::serialize_field(self, name, value)
    }

    fn end(self) -> Result<(), Stray> {
        Ok(())
    }
}

impl SerializeMap for Fields {
    type Ok = ();
    type Error = Stray;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, _: &T) -> Result<(), Stray> {
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stray> {
        value.serialize(Walk).map_err(|stray| stray.below(".<entry>"))
    }

    fn end(self) -> Result<(), Stray> {
        Ok(())
    }
}
