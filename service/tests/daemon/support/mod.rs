//! A daemon of its own for each test, on a free port of loopback, and a client that speaks the contract.

pub mod mission;

use pdn_schemas::reply::Problem;
use pdn_transport::session::{ZenohSettings, client_configuration};
use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use zenoh::bytes::Encoding;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Nothing here takes longer, on a machine that is busy with other tests too.
pub const BOUND: Duration = Duration::from_secs(60);

/// A daemon that runs until it is dropped.
pub struct Daemon {
    child: Child,
    log: Receiver<String>,
    /// Lines that came while it was waited for its end.
    unread: VecDeque<String>,
    /// Where it listens.
    pub endpoint: String,
}

impl Daemon {
    /// Starts one that listens on a free port, and waits until it says that it is ready.
    pub fn start(arguments: &[&str]) -> Daemon {
        let (child, log) = launch(&[&["-l", "tcp/127.0.0.1:0", "--log-format", "json"], arguments].concat());
        let mut daemon = Daemon { child, log, unread: VecDeque::new(), endpoint: String::new() };
        let ready = daemon.wait_for_line("\"ready\"");
        let line: Value = serde_json::from_str(&ready).expect("a JSON line");
        daemon.endpoint = line["listening"].as_str().expect("where it listens").to_owned();
        daemon
    }

    /// A client of it.
    pub fn client(&self) -> Client {
        let config = client_configuration(&ZenohSettings::default(), &self.endpoint);
        let session = zenoh::open(config.expect("a client's configuration")).wait();
        Client { session: session.expect("a session") }
    }

    /// Waits for a log line that contains `words`.
    pub fn wait_for_line(&mut self, words: &str) -> String {
        let deadline = Instant::now() + BOUND;
        let mut seen = Vec::new();
        loop {
            match self.next_line(deadline) {
                Ok(line) if line.contains(words) => return line,
                Ok(line) => seen.push(line),
                Err(error) => panic!("no line with {words:?} ({error:?}) but\n{}", seen.join("\n")),
            }
        }
    }

    fn next_line(&mut self, deadline: Instant) -> Result<String, RecvTimeoutError> {
        match self.unread.pop_front() {
            Some(line) => Ok(line),
            None => self.log.recv_timeout(deadline.saturating_duration_since(Instant::now())),
        }
    }

    /// Sends a signal such as `TERM`.
    pub fn signal(&self, signal: &str) {
        let sent = Command::new("kill").args(["-s", signal, &self.child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
    }

    /// Waits until it has ended, which closes its log.
    pub fn ended(&mut self) -> ExitStatus {
        let deadline = Instant::now() + BOUND;
        loop {
            match self.log.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(line) => self.unread.push_back(line),
                Err(RecvTimeoutError::Disconnected) => return self.child.wait().expect("a child"),
                Err(RecvTimeoutError::Timeout) => panic!("the daemon has not ended"),
            }
        }
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        // It may have ended already, which is what some tests are about.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Runs the program until it ends; gives exit code, standard output and standard error.
pub fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = command(arguments).output().expect("pdnd runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("no signal"), text(output.stdout), text(output.stderr))
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pdnd"));
    command.args(arguments);
    // What the person who runs the tests has set must not reach the daemon.
    for (name, _) in
        std::env::vars().filter(|(name, _)| name.starts_with("PDN_") || name.starts_with("ZENOH_"))
    {
        command.env_remove(name);
    }
    command
}

#[allow(clippy::disallowed_methods, reason = "a full queue of lines would hold up the daemon")]
fn launch(arguments: &[&str]) -> (Child, Receiver<String>) {
    let mut child = command(arguments).stderr(Stdio::piped()).spawn().expect("pdnd starts");
    let lines = BufReader::new(child.stderr.take().expect("a pipe"));
    let (sender, log) = channel();
    std::thread::spawn(move || {
        for line in lines.lines().map_while(Result::ok) {
            // The test may be over; the pipe is still emptied, or the daemon would wait.
            let _ = sender.send(line);
        }
    });
    (child, log)
}

/// A client that speaks JSON, as an independent program would.
pub struct Client {
    /// Its session.
    pub session: Session,
}

impl Client {
    /// Asks and waits for the reply, or the problem.
    pub fn ask(&self, selector: &str, payload: Option<Value>) -> Result<Value, Problem> {
        let body = payload.map(|payload| (payload.to_string().into_bytes(), "application/json".to_owned()));
        let (bytes, encoding) = self.ask_raw(selector, body)?;
        assert_eq!(encoding, "application/json");
        Ok(serde_json::from_slice(&bytes).expect("JSON"))
    }

    /// Asks with any payload, and gives the reply as it came.
    pub fn ask_raw(
        &self,
        selector: &str,
        body: Option<(Vec<u8>, String)>,
    ) -> Result<(Vec<u8>, String), Problem> {
        self.begin(selector, body).wait()
    }

    /// Asks without waiting.
    pub fn begin(&self, selector: &str, body: Option<(Vec<u8>, String)>) -> Pending {
        let get = self.session.get(selector).timeout(BOUND);
        let replies = match body {
            Some((bytes, encoding)) => get.payload(bytes).encoding(Encoding::from(encoding)).wait(),
            None => get.wait(),
        };
        Pending { selector: selector.to_owned(), replies: replies.expect("a query") }
    }

    /// Publishes an event as JSON.
    pub fn publish(&self, key: &str, event: &Value) {
        self.publish_raw(key, event.to_string().into_bytes(), "application/json");
    }

    /// Publishes anything.
    pub fn publish_raw(&self, key: &str, bytes: Vec<u8>, encoding: &str) {
        let put = self.session.put(key, bytes).encoding(Encoding::from(encoding));
        put.congestion_control(zenoh::qos::CongestionControl::Block).wait().expect("a publication");
    }

    /// Subscribes.
    pub fn subscribe(&self, key: &str) -> Heard {
        Heard(self.session.declare_subscriber(key.to_owned()).wait().expect("a subscriber"))
    }
}

/// A question that waits for its reply.
pub struct Pending {
    selector: String,
    replies: FifoChannelHandler<zenoh::query::Reply>,
}

impl Pending {
    /// The reply, or the problem.
    pub fn wait(self) -> Result<(Vec<u8>, String), Problem> {
        let Pending { selector, replies } = self;
        let reply = replies.recv().unwrap_or_else(|_| panic!("no reply to {selector}"));
        match reply.into_result() {
            Ok(sample) => Ok((sample.payload().to_bytes().to_vec(), sample.encoding().to_string())),
            Err(error) => {
                assert_eq!(error.encoding().to_string(), "application/json", "{selector}: {error:?}");
                Err(serde_json::from_slice(&error.payload().to_bytes()).expect("a problem"))
            }
        }
    }
}

/// A subscription.
pub struct Heard(Subscriber<FifoChannelHandler<Sample>>);

impl Heard {
    /// Waits for a publication that fits.
    pub fn wait_for(&self, what: &str, fits: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + BOUND;
        loop {
            let sample = match self.0.recv_deadline(deadline) {
                Ok(Some(sample)) => sample,
                Ok(None) => panic!("{what}: {:?}", RecvTimeoutError::Timeout),
                Err(error) => panic!("{what}: {error}"),
            };
            let value: Value = serde_json::from_slice(&sample.payload().to_bytes()).expect("JSON");
            if fits(&value) {
                return value;
            }
        }
    }
}
