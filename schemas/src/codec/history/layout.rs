//! The text of a layout, as [`crate::registry::describe`] writes it, read back.

use std::str::FromStr;

/// How a container or a field lies in bincode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    Bool,
    /// An unsigned integer of so many bytes.
    Unsigned(usize),
    /// A signed integer of so many bytes.
    Signed(usize),
    F32,
    F64,
    Text,
    /// A container of that name.
    Named(String),
    Optional(Box<Layout>),
    List(Box<Layout>),
    Array(Box<Layout>, usize),
    Tuple(Vec<Layout>),
    /// A map from texts.
    Map(Box<Layout>),
    Struct(Vec<(String, Layout)>),
    Enum(Vec<Variant>),
}

/// One variant of an enum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Variant {
    pub(super) tag: u32,
    pub(super) name: String,
    /// None of a variant that is only a name.
    pub(super) content: Option<Layout>,
}

impl Layout {
    /// The layout of a text.
    ///
    /// # Errors
    /// What is wrong, and before which rest of the text.
    pub(super) fn parse(text: &str) -> Result<Layout, String> {
        let mut rest = Rest(text);
        let layout = rest.layout()?;
        if rest.0.is_empty() { Ok(layout) } else { Err(rest.unexpected("the end")) }
    }

    /// Whether every value of the other has its place in this one: a struct has the other's fields, an enum
    /// its variants.
    #[cfg(test)]
    pub(super) fn includes(&self, other: &Layout) -> bool {
        match (self, other) {
            (Layout::Struct(fields), Layout::Struct(others)) => others
                .iter()
                .all(|(name, other)| fields.iter().any(|(own, field)| own == name && field.includes(other))),
            (Layout::Enum(variants), Layout::Enum(others)) => others.iter().all(|other| {
                variants.iter().any(|own| {
                    own.name == other.name
                        && match (&own.content, &other.content) {
                            (Some(own), Some(other)) => own.includes(other),
                            (own, other) => own == other,
                        }
                })
            }),
            (Layout::Optional(own), Layout::Optional(other)) => own.includes(other),
            (Layout::Optional(own), other) => own.includes(other),
            (own, other) => own == other,
        }
    }

    /// Shows the name of each container that stands in it.
    pub(super) fn visit_names<'a>(&'a self, show: &mut impl FnMut(&'a str)) {
        match self {
            Layout::Named(name) => show(name),
            Layout::Optional(inner) | Layout::List(inner) | Layout::Array(inner, _) | Layout::Map(inner) => {
                inner.visit_names(show)
            }
            Layout::Tuple(parts) => parts.iter().for_each(|part| part.visit_names(show)),
            Layout::Struct(fields) => fields.iter().for_each(|(_, field)| field.visit_names(show)),
            Layout::Enum(variants) => {
                let contents = variants.iter().filter_map(|variant| variant.content.as_ref());
                contents.for_each(|content| content.visit_names(show));
            }
            Layout::Bool
            | Layout::Unsigned(_)
            | Layout::Signed(_)
            | Layout::F32
            | Layout::F64
            | Layout::Text => {}
        }
    }
}

/// What of a text has not been read yet.
struct Rest<'a>(&'a str);

impl Rest<'_> {
    fn layout(&mut self) -> Result<Layout, String> {
        let mut layout = match self.0.chars().next() {
            Some('{') => self.fields()?,
            Some('<') => self.variants()?,
            Some('[') => self.array()?,
            Some('(') => Layout::Tuple(self.listed('(', ')', Rest::layout)?),
            _ => named(self.word()?),
        };
        loop {
            layout = match self.0.chars().next() {
                Some('?') => Layout::Optional(Box::new(layout)),
                Some('*') => Layout::List(Box::new(layout)),
                _ => return Ok(layout),
            };
            self.0 = &self.0[1..];
        }
    }

    /// A struct, or a map, whose only "field" is named `string`.
    fn fields(&mut self) -> Result<Layout, String> {
        let mut fields = self.listed('{', '}', |rest| {
            let name = rest.word()?.to_owned();
            rest.expect(':')?;
            Ok((name, rest.layout()?))
        })?;
        match &fields[..] {
            [(name, _)] if name == "string" => Ok(Layout::Map(Box::new(fields.swap_remove(0).1))),
            _ => Ok(Layout::Struct(fields)),
        }
    }

    fn variants(&mut self) -> Result<Layout, String> {
        let variants = self.listed('<', '>', |rest| {
            let tag = rest.number()?;
            rest.expect(':')?;
            let name = rest.word()?.to_owned();
            let content = match rest.0.chars().next() {
                Some('{') => Some(rest.fields()?),
                Some('(') => Some(rest.only_one()?),
                _ => None,
            };
            Ok(Variant { tag, name, content })
        })?;
        Ok(Layout::Enum(variants))
    }

    /// The content of a variant that has one value without a name.
    fn only_one(&mut self) -> Result<Layout, String> {
        let mut parts = self.listed('(', ')', Rest::layout)?;
        if parts.len() == 1 { Ok(parts.swap_remove(0)) } else { Ok(Layout::Tuple(parts)) }
    }

    fn array(&mut self) -> Result<Layout, String> {
        self.expect('[')?;
        let inner = self.layout()?;
        self.expect(';')?;
        let length = self.number()?;
        self.expect(']')?;
        Ok(Layout::Array(Box::new(inner), length))
    }

    fn listed<T>(
        &mut self,
        open: char,
        close: char,
        one: impl Fn(&mut Self) -> Result<T, String>,
    ) -> Result<Vec<T>, String> {
        self.expect(open)?;
        let mut all = Vec::new();
        while !self.0.starts_with(close) {
            if !all.is_empty() {
                self.expect(',')?;
            }
            all.push(one(self)?);
        }
        self.expect(close)?;
        Ok(all)
    }

    fn expect(&mut self, wanted: char) -> Result<(), String> {
        self.0 = self.0.strip_prefix(wanted).ok_or_else(|| self.unexpected(&format!("'{wanted}'")))?;
        Ok(())
    }

    fn word<'w>(&mut self) -> Result<&'w str, String>
    where
        Self: 'w,
    {
        let end = self.0.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(self.0.len());
        let (word, rest) = self.0.split_at(end);
        if word.is_empty() {
            return Err(self.unexpected("a name"));
        }
        self.0 = rest;
        Ok(word)
    }

    fn number<T: FromStr>(&mut self) -> Result<T, String> {
        let word = self.word()?;
        word.parse().map_err(|_| format!("{word:?} is no number"))
    }

    fn unexpected(&self, wanted: &str) -> String {
        format!("{wanted} is wanted before {:?}", self.0)
    }
}

fn named(word: &str) -> Layout {
    match word {
        "bool" => Layout::Bool,
        "u8" => Layout::Unsigned(1),
        "u16" => Layout::Unsigned(2),
        "u32" => Layout::Unsigned(4),
        "u64" => Layout::Unsigned(8),
        "i8" => Layout::Signed(1),
        "i16" => Layout::Signed(2),
        "i32" => Layout::Signed(4),
        "i64" => Layout::Signed(8),
        "f32" => Layout::F32,
        "f64" => Layout::F64,
        "string" => Layout::Text,
        name => Layout::Named(name.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_read() {
        let parsed = |text| Layout::parse(text).unwrap();
        assert_eq!(
            parsed("{a:u64,b:[f64;3]}"),
            Layout::Struct(vec![
                ("a".to_owned(), Layout::Unsigned(8)),
                ("b".to_owned(), Layout::Array(Box::new(Layout::F64), 3)),
            ])
        );
        let link = Layout::Tuple(vec![Layout::Unsigned(4), Layout::F64]);
        assert_eq!(parsed("(u32,f64)*?"), Layout::Optional(Box::new(Layout::List(Box::new(link)))));
        assert_eq!(parsed("{string:u64}"), Layout::Map(Box::new(Layout::Unsigned(8))));
        let Layout::Enum(variants) = parsed("<0:explore{},1:words([u32;2]*),2:none>") else { panic!() };
        let contents: Vec<Option<Layout>> = variants.into_iter().map(|variant| variant.content).collect();
        let words = Layout::List(Box::new(Layout::Array(Box::new(Layout::Unsigned(4)), 2)));
        assert_eq!(contents, [Some(Layout::Struct(Vec::new())), Some(words), None]);
    }

    #[test]
    fn what_is_no_layout_is_refused() {
        for text in ["", "{a}", "{a:u64", "<x:a>", "[u8]", "[u8;x]", "u8 ", "{a:u64}}", "?"] {
            assert!(Layout::parse(text).is_err(), "{text}");
        }
    }
}
