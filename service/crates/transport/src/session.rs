//! The Zenoh session: its configuration, checked before the network is touched, opening and closing.

use pdn_schemas::keys::every_vehicle;
use pdn_schemas::topics::Topic;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Duration;
use zenoh::config::EndPoint;

pub use zenoh::Session;
pub use zenoh::config::Config;

/// The built-in configuration, which a file can be laid over.
pub const BUILT_IN: &str = include_str!("../../../../deploy/zenoh.json5");

/// Link protocols that are compiled in.
pub const PROTOCOLS: [&str; 3] = ["tcp", "tls", "unixsock-stream"];

/// What the session is configured from.
#[derive(Clone, Debug, Default)]
pub struct ZenohSettings {
    /// Endpoints to serve on; empty: those of the configuration.
    pub listen: Vec<String>,
    /// Endpoints of routers to connect to; empty: those of the configuration.
    pub connect: Vec<String>,
    /// A file laid over [`BUILT_IN`], object by object.
    pub file: Option<PathBuf>,
}

/// Why there is no session, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The configuration file cannot be read.
    #[error(
        "cannot read the Zenoh configuration {}: {cause}; name an existing file with --zenoh-config or \
         ZENOH_CONFIG",
        .path.display()
    )]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The configuration file is no Zenoh configuration.
    #[error("{} is no Zenoh configuration: {cause}; compare it with deploy/zenoh.json5", .path.display())]
    Configuration {
        /// The file.
        path: PathBuf,
        /// What the parser says.
        cause: String,
    },
    /// An endpoint that Zenoh cannot read.
    #[error("{endpoint:?} is no endpoint ({cause}); write it as tcp/127.0.0.1:7447")]
    Endpoint {
        /// The endpoint.
        endpoint: String,
        /// What is wrong.
        cause: String,
    },
    /// Another program listens there.
    #[error(
        "cannot listen on {}: the address is in use. Another pdnd or Zenoh router may be running: stop it, \
         or choose another endpoint with -l, such as -l tcp/127.0.0.1:7448 (clients then need -e with the \
         same)",
        .endpoints.join(", ")
    )]
    InUse {
        /// Where it should have listened.
        endpoints: Vec<String>,
    },
    /// The session could not be opened for another reason.
    #[error(
        "cannot serve on {}: {cause}; check that the address is one of this machine's and that the port may \
         be used",
        .endpoints.join(", ")
    )]
    Open {
        /// Where it should have listened.
        endpoints: Vec<String>,
        /// What Zenoh says.
        cause: String,
    },
    /// A client found no router.
    #[error("cannot connect to {}: {cause}; check that pdnd runs and listens there", .endpoints.join(", "))]
    Connect {
        /// Where it tried.
        endpoints: Vec<String>,
        /// What Zenoh says.
        cause: String,
    },
    /// Opening took too long.
    #[error(
        "the Zenoh session was not open after {timeout:?}; raise open_timeout_ms or look at the endpoints"
    )]
    Timeout {
        /// How long it was given.
        timeout: Duration,
    },
    /// Zenoh, or the system, refused something that the service needs.
    #[error("cannot use {key}: {cause}")]
    Declare {
        /// The key, or what else was needed.
        key: String,
        /// What Zenoh says.
        cause: String,
    },
}

/// The daemon's configuration: the built-in one, the file over it, the endpoints over both.
pub fn configuration(settings: &ZenohSettings) -> Result<Config, SessionError> {
    let mut all = built_in();
    let origin = settings.file.clone().unwrap_or_else(|| PathBuf::from("the built-in configuration"));
    if let Some(path) = &settings.file {
        lay_over(&mut all, read(path)?);
    }
    let mut config = Config::from_json5(&all.to_string())
        .map_err(|cause| SessionError::Configuration { path: origin, cause: explained(&cause) })?;
    set_endpoints(&mut config, "listen/endpoints", &settings.listen)?;
    set_endpoints(&mut config, "connect/endpoints", &settings.connect)?;
    for endpoint in listens_on(&config).iter().chain(&connects_to(&config)) {
        check_endpoint(endpoint)?;
    }
    Ok(config)
}

/// The configuration of a client of the daemon, with the same transport and its security, but without the
/// daemon's rules for what goes through it.
pub fn client_configuration(settings: &ZenohSettings, endpoint: &str) -> Result<Config, SessionError> {
    check_endpoint(endpoint)?;
    let mut config = configuration(settings)?;
    let listed = serde_json::to_string(&[endpoint]).expect("a list of strings");
    for (key, value) in [
        ("mode", "\"client\""),
        ("listen/endpoints", "[]"),
        ("connect/endpoints", listed.as_str()),
        ("connect/timeout_ms", "0"),
        ("connect/exit_on_failure", "true"),
        ("qos/network", "[]"),
        ("access_control", "{\"enabled\": false}"),
    ] {
        config.insert_json5(key, value).map_err(|cause| SessionError::Endpoint {
            endpoint: endpoint.to_owned(),
            cause: cause.to_string(),
        })?;
    }
    Ok(config)
}

/// Endpoints that a configuration listens on.
pub fn listens_on(config: &Config) -> Vec<String> {
    endpoints(config, "listen/endpoints")
}

/// Endpoints that a configuration connects to.
pub fn connects_to(config: &Config) -> Vec<String> {
    endpoints(config, "connect/endpoints")
}

/// Opens the session. It must run on a multi-thread runtime of tokio.
pub async fn open(config: Config, timeout: Duration) -> Result<Session, SessionError> {
    let (listen, connect) = (listens_on(&config), connects_to(&config));
    let opened = tokio::time::timeout(timeout, zenoh::open(config)).await;
    let error = match opened {
        Ok(Ok(session)) => return Ok(session),
        Ok(Err(error)) => explained(&error),
        Err(_) => return Err(SessionError::Timeout { timeout }),
    };
    Err(if listen.is_empty() {
        SessionError::Connect { endpoints: connect, cause: error }
    } else if error.contains("in use") || error.contains("os error 98") {
        SessionError::InUse { endpoints: listen }
    } else {
        SessionError::Open { endpoints: listen, cause: error }
    })
}

/// Whether a daemon on the network of this session declares that it is ready, for whichever vehicle.
pub async fn finds_ready(session: &Session, timeout: Duration) -> bool {
    let Ok(replies) = session.liveliness().get(every_vehicle(Topic::AlivePlanner)).timeout(timeout).await
    else {
        return false;
    };
    let reply = tokio::time::timeout(timeout, replies.recv_async()).await;
    matches!(reply, Ok(Ok(reply)) if reply.result().is_ok())
}

/// Closes the session; false if that took longer than `timeout`.
pub async fn close(session: &Session, timeout: Duration) -> bool {
    matches!(tokio::time::timeout(timeout, session.close()).await, Ok(Ok(())))
}

/// What Zenoh says, without the places in its source.
fn explained(error: &zenoh::Error) -> String {
    let text = error.to_string();
    text.split(" at /").next().unwrap_or(&text).trim_end_matches(['!', '.', ' ']).to_owned()
}

fn built_in() -> Value {
    json5::from_str(BUILT_IN).expect("the built-in configuration is checked by a test")
}

fn read(path: &Path) -> Result<Value, SessionError> {
    let text = std::fs::read_to_string(path)
        .map_err(|cause| SessionError::Unreadable { path: path.to_owned(), cause })?;
    let refused = |cause: String| SessionError::Configuration { path: path.to_owned(), cause };
    let value: Value = json5::from_str(&text).map_err(|cause| refused(cause.to_string()))?;
    if !value.is_object() {
        return Err(refused("it must be an object".to_owned()));
    }
    Ok(value)
}

/// Objects are merged key by key; anything else is replaced.
fn lay_over(below: &mut Value, above: Value) {
    match (below, above) {
        (Value::Object(below), Value::Object(above)) => {
            for (key, value) in above {
                lay_over(below.entry(key).or_insert(Value::Null), value);
            }
        }
        (below, above) => *below = above,
    }
}

fn set_endpoints(config: &mut Config, key: &str, endpoints: &[String]) -> Result<(), SessionError> {
    for endpoint in endpoints {
        check_endpoint(endpoint)?;
    }
    if endpoints.is_empty() {
        return Ok(());
    }
    let listed = serde_json::to_string(endpoints).expect("a list of strings");
    config
        .insert_json5(key, &listed)
        .map_err(|cause| SessionError::Endpoint { endpoint: listed.clone(), cause: cause.to_string() })
}

fn check_endpoint(endpoint: &str) -> Result<(), SessionError> {
    let refused = |cause: String| SessionError::Endpoint { endpoint: endpoint.to_owned(), cause };
    let parsed: EndPoint = endpoint.parse().map_err(|cause: zenoh::Error| refused(explained(&cause)))?;
    let protocol = parsed.protocol().as_str().to_owned();
    if !PROTOCOLS.contains(&protocol.as_str()) {
        return Err(refused(format!("{protocol:?} is none of {}", PROTOCOLS.join(", "))));
    }
    if protocol != "unixsock-stream" {
        let port = parsed.address().as_str().rsplit_once(':').and_then(|(_, port)| port.parse::<u16>().ok());
        if port.is_none() {
            return Err(refused("it needs a port, 0 to 65535".to_owned()));
        }
    }
    Ok(())
}

fn endpoints(config: &Config, key: &str) -> Vec<String> {
    let text = config.get_json(key).unwrap_or_default();
    match serde_json::from_str(&text) {
        Ok(Value::Array(items)) => items.iter().filter_map(|item| item.as_str().map(str::to_owned)).collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_configuration_serves_on_loopback_and_looks_for_nobody() {
        let config = configuration(&ZenohSettings::default()).unwrap();
        assert_eq!(listens_on(&config), ["tcp/127.0.0.1:7447"]);
        assert!(connects_to(&config).is_empty());
        for (key, value) in [
            ("mode", "\"router\""),
            ("scouting/multicast/enabled", "false"),
            ("scouting/gossip/enabled", "false"),
            ("transport/link/rx/max_message_size", "16777216"),
        ] {
            assert_eq!(config.get_json(key).unwrap(), value, "{key}");
        }
    }

    #[test]
    fn endpoints_given_replace_those_of_the_configuration() {
        let settings = ZenohSettings {
            listen: vec!["tcp/127.0.0.1:1".into(), "unixsock-stream//tmp/pdn".into()],
            connect: vec!["tls/ship:7447".into()],
            file: None,
        };
        let config = configuration(&settings).unwrap();
        assert_eq!(listens_on(&config), settings.listen);
        assert_eq!(connects_to(&config), settings.connect);
        let client = client_configuration(&settings, "tcp/127.0.0.1:1").unwrap();
        assert!(listens_on(&client).is_empty());
        assert_eq!(connects_to(&client), ["tcp/127.0.0.1:1"]);
        assert_eq!(client.get_json("qos/network").unwrap(), "[]");
    }

    #[test]
    fn a_wrong_endpoint_is_refused_before_the_network_is_touched() {
        for wrong in
            ["", "7447", "tcp", "tcp/", "tcp/127.0.0.1", "tcp/127.0.0.1:99999", "carrier-pigeon/roof:1"]
        {
            let settings = ZenohSettings { listen: vec![wrong.into()], ..ZenohSettings::default() };
            let error = configuration(&settings).unwrap_err();
            assert!(matches!(error, SessionError::Endpoint { .. }), "{wrong:?}: {error}");
        }
    }

    #[test]
    fn a_file_is_laid_over_the_built_in_configuration() {
        let mut all = built_in();
        let file =
            json5::from_str("{transport: {link: {tx: {lease: 1234}}}, listen: {endpoints: []}}").unwrap();
        lay_over(&mut all, file);
        assert_eq!(all["transport"]["link"]["tx"]["lease"], 1234);
        assert_eq!(all["transport"]["link"]["rx"]["max_message_size"], 16_777_216);
        assert_eq!(all["listen"]["endpoints"], serde_json::json!([]));
        assert_eq!(all["listen"]["timeout_ms"], 0);
    }
}
