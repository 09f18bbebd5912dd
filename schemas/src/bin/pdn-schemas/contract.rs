//! All that the types tell of themselves: layouts by `serde-reflection`; docs, defaults and required fields
//! by `schemars`.

use crate::files::root;
use pdn_schemas::codec::{Message, MessageVisitor, visit_messages};
use pdn_schemas::keys::VERSION;
use pdn_schemas::record::Kind;
use pdn_schemas::registry;
use schemars::SchemaGenerator;
use serde_json::{Map, Value, json};
use serde_reflection::{ContainerFormat, Format, Registry, VariantFormat};
use std::collections::BTreeMap;

/// The folder of the layouts of all generations, `N.json` each.
const HISTORY: &str = "schemas/history";

/// The contract, taken apart.
pub struct Contract {
    /// Layout of each container by name.
    pub registry: Registry,
    /// JSON Schema of each container by name.
    definitions: Map<String, Value>,
}

/// A field of a struct or of a struct variant.
pub struct Field<'a> {
    /// Its name on the wire.
    pub name: &'a str,
    /// Its layout.
    pub format: &'a Format,
    /// What it means.
    pub doc: &'a str,
    /// What it is when JSON leaves it out; none if JSON must have it.
    pub default: Option<Value>,
}

/// A variant of an enum.
pub struct Variant<'a> {
    /// Its name on the wire.
    pub name: &'a str,
    /// Its number in bincode.
    pub tag: u32,
    /// What it means.
    pub doc: &'a str,
    /// What it contains.
    pub content: Content<'a>,
}

/// What a variant contains.
pub enum Content<'a> {
    /// Nothing.
    Unit,
    /// One value.
    One(&'a Format),
    /// Named fields.
    Fields(Vec<Field<'a>>),
}

/// A named type of the contract.
pub enum Shape<'a> {
    /// A struct.
    Struct(Vec<Field<'a>>),
    /// An enum.
    Enum(Vec<Variant<'a>>),
}

impl Contract {
    /// Asks the types.
    pub fn extract() -> Contract {
        struct Define(SchemaGenerator);
        impl MessageVisitor for Define {
            fn visit<T: Message>(&mut self) {
                self.0.subschema_for::<T>();
            }
        }
        let mut define = Define(SchemaGenerator::default());
        visit_messages(&mut define);
        Contract { registry: registry::registry(), definitions: define.0.take_definitions(false) }
    }

    /// What a named type means.
    pub fn doc(&self, name: &str) -> &str {
        doc(&self.definitions[name])
    }

    /// A named type with its docs.
    pub fn shape<'a>(&'a self, name: &str) -> Shape<'a> {
        let schema = &self.definitions[name];
        match &self.registry[name] {
            ContainerFormat::Struct(fields) => {
                let fields = fields.iter().map(|field| (field.name.as_str(), &field.value));
                Shape::Struct(fields.map(|(name, format)| described(schema, name, format)).collect())
            }
            ContainerFormat::Enum(variants) => {
                let variant = |(&tag, variant): (&u32, &'a serde_reflection::Named<VariantFormat>)| {
                    self.variant(schema, tag, variant)
                };
                Shape::Enum(variants.iter().map(variant).collect())
            }
            other => panic!("{name}: the contract has no {other:?}"),
        }
    }

    fn variant<'a>(
        &'a self,
        schema: &'a Value,
        tag: u32,
        variant: &'a serde_reflection::Named<VariantFormat>,
    ) -> Variant<'a> {
        let name = variant.name.as_str();
        let is_it = |one: &&Value| one["const"] == name || one["properties"].get(name).is_some();
        let all = schema["oneOf"].as_array().expect("every variant has a doc, so the schema is a oneOf");
        let one = all.iter().find(is_it).expect("the schema has every variant");
        let content = match &variant.value {
            VariantFormat::Unit => Content::Unit,
            VariantFormat::NewType(inner) => Content::One(inner),
            VariantFormat::Struct(fields) => {
                let inner = &one["properties"][name];
                let field =
                    |field: &'a serde_reflection::Named<Format>| described(inner, &field.name, &field.value);
                Content::Fields(fields.iter().map(field).collect())
            }
            other => panic!("{name}: the contract has no {other:?}"),
        };
        Variant { name, tag, doc: doc(one), content }
    }

    /// Whether a named type is an enum without content, a mere choice of names.
    pub fn is_choice(&self, name: &str) -> bool {
        matches!(self.shape(name), Shape::Enum(variants)
            if variants.iter().all(|variant| matches!(variant.content, Content::Unit)))
    }

    /// Names of all types, each after those that it contains.
    pub fn names_in_order(&self) -> Vec<&str> {
        let mut order: Vec<&str> = Vec::new();
        while order.len() < self.registry.len() {
            let ready = |name: &&&String| {
                let inside = registry::reached(&self.registry, name);
                let known = |other: &String| *other == ***name || order.contains(&other.as_str());
                !order.contains(&name.as_str()) && inside.iter().all(known)
            };
            order.push(self.registry.keys().find(|name| ready(&name)).expect("no type contains itself"));
        }
        order
    }

    /// `schemas/generated/registry.json`: the hash of every message and the layout of every container.
    pub fn registry_json(&self) -> String {
        let hashes = registry::layout_hashes().into_iter();
        let messages: BTreeMap<&str, String> =
            hashes.map(|(name, hash)| (name, format!("{hash:016x}"))).collect();
        let layout =
            |(name, container): (&String, &ContainerFormat)| (name.clone(), registry::describe(container));
        let containers: BTreeMap<String, String> = self.registry.iter().map(layout).collect();
        pretty(&json!({ "contract": VERSION, "messages": messages, "containers": containers }))
    }

    /// The JSON Schema of every message.
    pub fn json_schemas(&self) -> Vec<(&'static str, String)> {
        struct Schemas(Vec<(&'static str, String)>);
        impl MessageVisitor for Schemas {
            fn visit<T: Message>(&mut self) {
                self.0.push((T::NAME, pretty(schemars::schema_for!(T).as_value())));
            }
        }
        let mut schemas = Schemas(Vec::new());
        visit_messages(&mut schemas);
        schemas.0
    }

    /// `schemas/history/N.json`: the layout of every container and the record of every kind of the journal.
    fn generation_json() -> String {
        let registry = registry::journal_registry();
        let layout =
            |(name, container): (&String, &ContainerFormat)| (name.clone(), registry::describe(container));
        let containers: BTreeMap<String, String> = registry.iter().map(layout).collect();
        let kinds: Vec<&str> = Kind::ALL.iter().map(|kind| kind.schema()).collect();
        pretty(&json!({ "kinds": kinds, "containers": containers }))
    }

    /// The file of the present layouts: the newest generation's if they are its, else that of a new one.
    pub fn generation() -> (String, String) {
        let path = |number: usize| format!("{HISTORY}/{number}.json");
        let newest = (1..).take_while(|&number| root().join(path(number)).exists()).last().unwrap_or(0);
        let present = Contract::generation_json();
        let is_newest = std::fs::read_to_string(root().join(path(newest))).is_ok_and(|text| text == present);
        (path(if is_newest { newest } else { newest + 1 }), present)
    }

    /// Fails if the present layouts are no generation's.
    pub fn check_history() -> Result<(), String> {
        let (path, _) = Contract::generation();
        if root().join(&path).exists() {
            return Ok(());
        }
        Err(format!(
            "the layouts have changed since the newest of {HISTORY}: what is in the field must stay \
             readable. Keep golden vectors of what has changed in the folder of the generation before, \
             make a new one by `cargo run --release -p pdn-schemas -- release`, and name {path} in \
             schemas/src/codec/history.rs"
        ))
    }
}

fn described<'a>(schema: &'a Value, name: &'a str, format: &'a Format) -> Field<'a> {
    let property = &schema["properties"][name];
    let required = schema["required"].as_array().is_some_and(|all| all.iter().any(|one| one == name));
    let default = (!required).then(|| property.get("default").cloned().unwrap_or(Value::Null));
    Field { name, format, doc: doc(property), default }
}

fn doc(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

fn pretty(value: &Value) -> String {
    let mut text = serde_json::to_string_pretty(value).expect("a schema is plain JSON");
    text.push('\n');
    text
}
