//! What can be asked of the program, and how it ends.

mod journal;

use crate::settings::{self, Layers, Settings, SettingsError};
use crate::state_dir::{StateDir, StateDirError};
use crate::{health, serve, telemetry};
use clap::{Args, Parser, Subcommand};
use pdn_transport::session::{self, SessionError, ZenohSettings};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use toml::Value;

/// The perception-driven navigation daemon: pose graphs, beliefs and decisions for vehicles, over Zenoh.
///
/// Without a command it serves until SIGTERM or SIGINT. With nothing but defaults it listens on
/// tcp/127.0.0.1:7447.
#[derive(Debug, Parser)]
#[command(name = "pdnd", version, about, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    flags: Flags,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Check a settings file, with the environment and flags over it, without touching the network
    CheckConfig {
        /// The file to check instead of the one that --config names
        file: Option<PathBuf>,
    },
    /// Print every setting with its meaning, range and default
    Config {
        /// Print the settings in force instead
        #[arg(long)]
        effective: bool,
    },
    /// Ask whether a daemon is ready; exit code 0 if it is, 1 if not
    Health {
        /// Time to wait for an answer, ms
        #[arg(long, value_name = "MS", default_value_t = 3000)]
        timeout_ms: u64,
    },
    /// Tell what a mission's journal says; exit code 1 if it is damaged
    Journal(journal::ShowArgs),
    /// Write what is whole of a damaged journal, up to its damage, to a new one
    Recover(journal::RecoverArgs),
    /// Take every decision of a journal again and compare it bit for bit; exit code 1 if any differs
    Replay(journal::ReplayArgs),
}

#[derive(Debug, Args)]
struct Flags {
    /// Endpoint to serve on; may be given more than once
    #[arg(short, long, value_name = "ENDPOINT", global = true)]
    listen: Vec<String>,
    /// Endpoint of a router to connect to (for `health`: of the daemon); may be given more than once
    #[arg(short = 'e', long, value_name = "ENDPOINT", global = true)]
    connect: Vec<String>,
    /// Settings file; `pdnd config` prints one
    #[arg(long, value_name = "FILE", env = "PDN_CONFIG", global = true)]
    config: Option<PathBuf>,
    /// Zenoh configuration (JSON5), laid over the built-in one
    #[arg(long, value_name = "FILE", env = "ZENOH_CONFIG", global = true)]
    zenoh_config: Option<PathBuf>,
    /// Directory of the journals, from which missions come back; without it nothing is kept
    #[arg(long, value_name = "DIR", global = true)]
    state_dir: Option<PathBuf>,
    /// Form of the log: human or json
    #[arg(long, value_name = "FORM", global = true)]
    log_format: Option<String>,
    /// Least level that is logged, or a filter
    #[arg(long, value_name = "LEVEL", global = true)]
    log_level: Option<String>,
    /// Any setting by its name; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE", global = true)]
    set: Vec<String>,
}

const EXIT_CODES: &str = "\
Exit codes:
  0  well
  1  a failure while running, no daemon is ready (health), a journal is damaged, or a decision differs \
     (replay)
  2  wrong usage or settings; nothing was started
  3  an endpoint is in use or cannot be had, or the state directory or a journal cannot be used

Every setting can stand in a file (--config), in the environment as PDN_<NAME>, or in --set; the later wins.";

/// Why the program ends otherwise than well.
enum Failure {
    Running(String),
    Usage(String),
    Unavailable(String),
}

impl From<SettingsError> for Failure {
    fn from(error: SettingsError) -> Failure {
        Failure::Usage(error.to_string())
    }
}

impl From<StateDirError> for Failure {
    fn from(error: StateDirError) -> Failure {
        Failure::Unavailable(error.to_string())
    }
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Failure {
        match error {
            SessionError::Unreadable { .. }
            | SessionError::Configuration { .. }
            | SessionError::Endpoint { .. } => Failure::Usage(error.to_string()),
            SessionError::InUse { .. } | SessionError::Open { .. } | SessionError::Timeout { .. } => {
                Failure::Unavailable(error.to_string())
            }
            SessionError::Connect { .. } | SessionError::Declare { .. } => {
                Failure::Running(error.to_string())
            }
        }
    }
}

/// Reads the command line, does what it says and gives the exit code.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let done = match &cli.command {
        None => serve(&cli.flags),
        Some(Command::CheckConfig { file }) => check(&cli.flags, file.as_ref()),
        Some(Command::Config { effective: false }) => print(&settings::document()),
        Some(Command::Config { effective: true }) => effective(&cli.flags),
        Some(Command::Journal(arguments)) => journal::show(arguments),
        Some(Command::Recover(arguments)) => journal::recover(arguments),
        Some(Command::Replay(arguments)) => journal::replay(arguments),
        Some(Command::Health { timeout_ms }) => ask_health(&cli.flags, Duration::from_millis(*timeout_ms)),
    };
    let (code, message) = match done {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Running(message)) => (1, message),
        Err(Failure::Usage(message)) => (2, message),
        Err(Failure::Unavailable(message)) => (3, message),
    };
    eprintln!("pdnd: {message}");
    ExitCode::from(code)
}

impl Flags {
    fn layers(&self, file: Option<&PathBuf>) -> Result<Layers, SettingsError> {
        let list = |given: &[String]| {
            (!given.is_empty()).then(|| Value::Array(given.iter().cloned().map(Value::from).collect()))
        };
        let path =
            |given: &Option<PathBuf>| given.as_ref().map(|path| Value::from(path.display().to_string()));
        let text = |given: &Option<String>| given.clone().map(Value::from);
        let mut layers = Layers::default()
            .with_file(file.or(self.config.as_ref()).map(PathBuf::as_path))?
            .with_environment(std::env::vars())?;
        for assignment in &self.set {
            layers = layers.with_assignment(assignment)?;
        }
        Ok(layers
            .with_flag("listen", list(&self.listen))
            .with_flag("connect", list(&self.connect))
            .with_flag("zenoh_config", path(&self.zenoh_config))
            .with_flag("state_dir", path(&self.state_dir))
            .with_flag("log_format", text(&self.log_format))
            .with_flag("log_level", text(&self.log_level)))
    }
}

fn zenoh_settings(settings: &Settings) -> ZenohSettings {
    let file = Some(settings.zenoh_config.clone()).filter(|path| !path.as_os_str().is_empty());
    ZenohSettings { listen: settings.listen.clone(), connect: settings.connect.clone(), file }
}

fn serve(flags: &Flags) -> Result<(), Failure> {
    let layers = flags.layers(None)?;
    let settings = layers.resolve()?;
    let zenoh = session::configuration(&zenoh_settings(&settings))?;
    telemetry::start(settings.log_format, &settings.log_level);
    for variable in layers.unknown_variables() {
        tracing::warn!(%variable, "no setting has this name; `pdnd config` lists them");
    }
    let _state_dir = StateDir::open(&settings.state_dir)?;
    let runtime = runtime()?;
    let drained = runtime.block_on(serve::serve(&settings, zenoh));
    // A journal that is being read must not hold up the end.
    runtime.shutdown_background();
    let drained = drained?;
    if drained {
        return Ok(());
    }
    Err(Failure::Running(format!(
        "not all that was accepted could be finished within drain_ms = {}; what was not acknowledged must be \
         sent again",
        settings.drain_ms
    )))
}

fn check(flags: &Flags, file: Option<&PathBuf>) -> Result<(), Failure> {
    let settings = flags.layers(file)?.resolve()?;
    let zenoh = session::configuration(&zenoh_settings(&settings))?;
    let file = file.or(flags.config.as_ref());
    let what = file.map_or_else(|| "the default settings".to_owned(), |file| file.display().to_string());
    print(&format!("{what}: well; pdnd would listen on {}\n", session::listens_on(&zenoh).join(", ")))
}

fn effective(flags: &Flags) -> Result<(), Failure> {
    let mut settings = flags.layers(None)?.resolve()?;
    let zenoh = session::configuration(&zenoh_settings(&settings))?;
    settings.listen = session::listens_on(&zenoh);
    settings.connect = session::connects_to(&zenoh);
    settings.planner_threads = u64::try_from(settings.planner_threads()).unwrap_or(u64::MAX);
    let text = toml::to_string(&settings).map_err(|error| Failure::Running(error.to_string()))?;
    print(&text)
}

fn ask_health(flags: &Flags, timeout: Duration) -> Result<(), Failure> {
    let settings = flags.layers(None)?.resolve()?;
    let mut zenoh = zenoh_settings(&settings);
    let named = std::mem::take(&mut zenoh.connect);
    let endpoint = match named.first() {
        Some(endpoint) => endpoint.clone(),
        None => health::reachable(&session::listens_on(&session::configuration(&zenoh)?)),
    };
    let config = session::client_configuration(&zenoh, &endpoint)?;
    match runtime()?.block_on(health::is_ready(config, timeout)) {
        Ok(true) => print(&format!("pdnd on {endpoint} is ready\n")),
        Ok(false) => {
            Err(Failure::Running(format!("a router answers on {endpoint}, but no pdnd is ready behind it")))
        }
        Err(error) => Err(Failure::Running(format!("no pdnd is ready on {endpoint}: {error}"))),
    }
}

fn runtime() -> Result<tokio::runtime::Runtime, Failure> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::Running(format!("cannot start threads: {error}")))
}

/// Writes to standard output; a reader that has gone away, as in `pdnd config | head`, is no failure.
fn print(text: &str) -> Result<(), Failure> {
    use std::io::Write;
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Running(error.to_string()))
        }
        _ => Ok(()),
    }
}
