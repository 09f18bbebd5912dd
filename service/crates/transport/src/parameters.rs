//! The parameters of a query: `after=12;deadline_ms=500;detail=full`. A name that the key does not take, a
//! name given twice or a value that cannot be read is refused by name: a mistyped what-if must not pass for
//! the plain question.

use pdn_schemas::limits::MAX_PARAMETERS_CHARS;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::{COMMON_PARAMETERS, Topic};
use std::collections::BTreeMap;
use std::str::FromStr;

/// The text of the parameters, not yet parsed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parameters(String);

/// The parameters, parsed: each name at most once, each one that the key takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParsedParameters(BTreeMap<String, String>);

impl Parameters {
    /// The text as it stood in the query; one that is too long is cut, and then refused by [`Self::parse`].
    pub fn new(text: &str) -> Parameters {
        Parameters(text.chars().take(MAX_PARAMETERS_CHARS + 1).collect())
    }

    /// Bytes of the text.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether the reply shall be bincode; what else is wrong is told elsewhere.
    pub fn wants_bincode(&self) -> bool {
        self.0.split(';').any(|part| part.trim() == "encoding=bincode")
    }

    /// Whether `after=` is among them; what else is wrong is told elsewhere.
    pub fn has_after(&self) -> bool {
        self.0.split(';').any(|part| part.trim().starts_with("after"))
    }

    /// Parses them for `topic`.
    ///
    /// # Errors
    /// `invalid`, with the name and the names that the key takes; `too_large`.
    pub fn parse(&self, topic: Topic) -> Result<ParsedParameters, Problem> {
        if self.0.chars().count() > MAX_PARAMETERS_CHARS {
            let message =
                format!("the parameters are longer than MAX_PARAMETERS_CHARS = {MAX_PARAMETERS_CHARS}");
            return Err(Problem::new(Code::TooLarge, message, None));
        }
        let mut named = BTreeMap::new();
        for part in self.0.split(';').map(str::trim).filter(|part| !part.is_empty()) {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            let taken: Vec<_> =
                topic.parameters().iter().chain(COMMON_PARAMETERS).map(|parameter| parameter.name).collect();
            if !taken.contains(&name) {
                return Err(invalid(format!(
                    "{} takes no parameter {name:?}; it takes {}",
                    topic.suffix(),
                    taken.join(", ")
                )));
            }
            if named.insert(name.to_owned(), value.to_owned()).is_some() {
                return Err(invalid(format!("the parameter {name} is given twice")));
            }
        }
        let named = ParsedParameters(named);
        named.one_of("encoding", &["json", "bincode"])?;
        Ok(named)
    }
}

impl ParsedParameters {
    /// The text of a parameter, if it was given.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// A whole number from 0.
    pub fn whole(&self, name: &str) -> Result<Option<u64>, Problem> {
        self.read(name, "a whole number from 0")
    }

    /// A finite number.
    pub fn number(&self, name: &str) -> Result<Option<f64>, Problem> {
        match self.read::<f64>(name, "a number")? {
            Some(value) if !value.is_finite() => Err(invalid(format!("{name}={value} is not finite"))),
            value => Ok(value),
        }
    }

    /// `true` or `false`; false if it was not given.
    pub fn flag(&self, name: &str) -> Result<bool, Problem> {
        Ok(self.one_of(name, &["false", "true"])? == Some("true"))
    }

    /// One of some words.
    pub fn one_of(&self, name: &str, words: &[&str]) -> Result<Option<&str>, Problem> {
        match self.text(name) {
            Some(text) if !words.contains(&text) => {
                Err(invalid(format!("{name}={text:?} cannot be read: give {}", words.join(" or "))))
            }
            text => Ok(text),
        }
    }

    fn read<T: FromStr>(&self, name: &str, what: &str) -> Result<Option<T>, Problem> {
        let Some(text) = self.text(name) else { return Ok(None) };
        text.parse().map(Some).map_err(|_| invalid(format!("{name}={text:?} cannot be read: give {what}")))
    }
}

fn invalid(message: String) -> Problem {
    Problem::new(Code::Invalid, message, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> Problem {
        let named = Parameters::new(text).parse(Topic::RpcDecision);
        let read = |named: ParsedParameters| -> Result<(), Problem> {
            named.whole("after")?;
            named.whole("deadline_ms")?;
            named.number("alpha")?;
            named.one_of("detail", &["brief", "full", "choice"])?;
            Ok(())
        };
        named.and_then(read).expect_err(text)
    }

    #[test]
    fn parameters_are_read_by_name() {
        let text = "after=12;alpha=0.5; detail=full;encoding=bincode;mission=m1";
        let parameters = Parameters::new(text);
        assert!(parameters.wants_bincode() && parameters.has_after());
        let named = parameters.parse(Topic::RpcDecision).unwrap();
        assert_eq!(named.whole("after").unwrap(), Some(12));
        assert_eq!(named.number("alpha").unwrap(), Some(0.5));
        assert_eq!(named.text("mission"), Some("m1"));
        assert_eq!(named.whole("deadline_ms").unwrap(), None);
        assert!(!named.flag("marginals").unwrap());
        assert!(Parameters::new("").parse(Topic::RpcMission).is_ok());
        assert!(!Parameters::new("mission=after").has_after());
    }

    #[test]
    fn what_cannot_be_read_is_refused_by_name() {
        for (text, word) in [
            ("alhpa=0.5", "alhpa"),
            ("marginals=true", "marginals"),
            ("after", "after"),
            ("after=-1", "after=\"-1\""),
            ("after=1;after=2", "twice"),
            ("alpha=inf", "finite"),
            ("alpha=NaN", "finite"),
            ("alpha=half", "half"),
            ("detail=everything", "brief or full or choice"),
            ("encoding=xml", "json or bincode"),
            ("deadline_ms=0.5", "deadline_ms"),
        ] {
            let problem = refusal(text);
            assert_eq!(problem.code, "invalid", "{text}");
            assert!(problem.message.contains(word), "{text}: {}", problem.message);
        }
        assert_eq!(refusal(&"a".repeat(5000)).code, "too_large");
    }
}
