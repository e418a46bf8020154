//! The page of a [`Picker`] at an address of this machine, and what it may ask.
//!
//! | request | answer |
//! |---|---|
//! | `GET /SECRET/` | the page |
//! | `POST /SECRET/pairs` | writes the pairs file and says how many pairs it has, or says what is wrong with it |
//! | `POST /SECRET/done` | ends the wait |
//!
//! It listens on 127.0.0.1 alone. The secret has 128 random bits. A request that names another host than this machine
//! is refused: that is how a page elsewhere would reach this one under a name of its own. One that comes from another
//! page is refused by its `Origin`.

use std::io::{BufReader, Read};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::Picker;
use super::http::{Answer, Head};
use crate::error::{Error, Result};
use crate::session::stop::StopFlag;

/// The most bytes of a pairs file that are taken: over 500,000 pairs.
pub(super) const MOST_PAIRS: usize = 16 << 20;

/// The most connections at a time. A browser opens six, some of which never say anything.
const MOST_CONNECTIONS: usize = 32;

/// How long a connection may say nothing.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long the other end of an answered connection may take to close it.
const LINGER: Duration = Duration::from_millis(500);

/// How often a new connection or a stop is looked for.
const PAUSE: Duration = Duration::from_millis(20);

/// No pairs have been saved.
const NOTHING: usize = usize::MAX;

/// A page that is offered, until [`Self::wait`] ends.
#[derive(Debug)]
pub struct Served {
    listener: TcpListener,
    port: u16,
    site: Arc<Site>,
}

/// What all connections share.
#[derive(Debug)]
struct Site {
    picker: Picker,
    /// The pairs that the page begins with: those given, then those saved last, so that it may be loaded again.
    pairs: Mutex<Option<String>>,
    secret: String,
    /// How many pairs the file has that was saved last, or [`NOTHING`].
    saved: AtomicUsize,
    done: AtomicBool,
    connections: AtomicUsize,
}

impl Served {
    pub(super) fn new(picker: Picker) -> Result<Self> {
        let mut bits = [0; 16];
        getrandom::fill(&mut bits).map_err(Error::failure)?;
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            port: listener.local_addr()?.port(),
            listener,
            site: Arc::new(Site {
                pairs: Mutex::new(picker.given.clone()),
                picker,
                secret: bits.iter().map(|byte| format!("{byte:02x}")).collect(),
                saved: AtomicUsize::new(NOTHING),
                done: AtomicBool::new(false),
                connections: AtomicUsize::new(0),
            }),
        })
    }

    /// The port that it listens on.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// What a browser opens. Who knows it can write the pairs file.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.site.secret)
    }

    /// Answers the page until it says that it is done, or `stop` is set; how many pairs were saved last, if any.
    ///
    /// # Errors
    /// An interruption if it is stopped before anything was saved; what the system says of the port.
    pub fn wait(&self, stop: &StopFlag) -> Result<Option<usize>> {
        let saved =
            || Some(self.site.saved.load(Ordering::SeqCst)).filter(|&count| count != NOTHING);
        while !self.site.done.load(Ordering::SeqCst) {
            if stop.is_set() {
                let nothing = || Error::interruption("interrupted before any pairs were saved");
                return saved().ok_or_else(nothing).map(Some);
            }
            match self.listener.accept() {
                Ok((stream, _)) => self.admit(stream),
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {
                    std::thread::sleep(PAUSE);
                }
                // Of one connection, which has gone again.
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionAborted => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(saved())
    }

    /// Answers a connection beside the others, unless there are too many.
    fn admit(&self, stream: TcpStream) {
        let site = Arc::clone(&self.site);
        if site.connections.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
            site.connections.fetch_sub(1, Ordering::SeqCst);
            return;
        }
        std::thread::spawn(move || {
            // Who has gone needs no answer.
            let _ = site.answer_on(stream);
            site.connections.fetch_sub(1, Ordering::SeqCst);
        });
    }
}

impl Site {
    /// Reads a request and answers it.
    fn answer_on(&self, stream: TcpStream) -> std::io::Result<()> {
        // On some systems what is accepted does not wait, as the listener does not.
        stream.set_nonblocking(false)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        let mut incoming = BufReader::new(&stream);
        let head = match Head::read(&mut incoming) {
            Ok(Some(head)) => head,
            Ok(None) => return Ok(()),
            Err(refusal) => {
                refusal.write(&mut &stream)?;
                return end(&stream);
            }
        };
        let answer = self.answer(&head, &mut incoming);
        let (Ok(answer) | Err(answer)) = answer;
        answer.write(&mut &stream)?;
        // The process may end at once, so the page has its answer before.
        if head.method == "POST" && answer.status == OK && head.path.ends_with("/done") {
            self.done.store(true, Ordering::SeqCst);
        }
        end(&stream)
    }

    /// The answer; what is refused is an error.
    fn answer(&self, head: &Head, incoming: &mut impl Read) -> std::result::Result<Answer, Answer> {
        let host = head.header("host").unwrap_or_default();
        if !is_this_machine(host) {
            let text = "this address is of 127.0.0.1 and localhost alone";
            return Err(Answer::text("403 Forbidden", text));
        }
        let asked = self.within(&head.path);
        let asked = asked.ok_or_else(|| Answer::text("404 Not Found", "nothing is here"))?;
        match (head.method.as_str(), asked) {
            ("GET", "") => {
                return Ok(Answer {
                    status: OK,
                    kind: "text/html; charset=utf-8",
                    body: self.picker.html(self.pairs().clone(), true).into_bytes(),
                });
            }
            ("POST", "pairs" | "done") => {}
            (_, "" | "pairs" | "done") => {
                let text = "the page is read with GET, pairs are sent with POST";
                return Err(Answer::text("405 Method Not Allowed", text));
            }
            _ => return Err(Answer::text("404 Not Found", "nothing is here")),
        }
        let own = format!("http://{host}");
        if head.header("origin") != Some(own.as_str()) {
            let text = "only the page itself may send";
            return Err(Answer::text("403 Forbidden", text));
        }
        let body = head.body(incoming, MOST_PAIRS)?;
        if asked == "done" {
            return Ok(Answer::text(OK, "done"));
        }
        let refused = |text: String| Answer::text("422 Unprocessable Content", text);
        let text = String::from_utf8(body).map_err(|error| refused(error.to_string()))?;
        let count = self.picker.save(&text);
        let count = count.map_err(|error| refused(error.to_string()))?;
        self.saved.store(count, Ordering::SeqCst);
        *self.pairs() = Some(text);
        Ok(Answer::text(OK, count.to_string()))
    }

    fn pairs(&self) -> MutexGuard<'_, Option<String>> {
        self.pairs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What follows the secret in a path, if it is the right one.
    fn within<'a>(&self, path: &'a str) -> Option<&'a str> {
        let (secret, rest) = path.strip_prefix('/')?.split_once('/')?;
        let pairs = secret.bytes().zip(self.secret.bytes());
        // All bytes are compared, so that the time says nothing of how many are right.
        let differing = pairs.fold(0, |differing, (a, b)| differing | (a ^ b));
        (secret.len() == self.secret.len() && differing == 0).then_some(rest)
    }
}

const OK: &str = "200 OK";

/// Ends a connection. What was sent and not read is read first: a system resets a connection that is closed with such
/// bytes, and the answer may be lost.
fn end(stream: &TcpStream) -> std::io::Result<()> {
    stream.shutdown(Shutdown::Write)?;
    stream.set_read_timeout(Some(LINGER))?;
    std::io::copy(&mut stream.take(MOST_PAIRS as u64), &mut std::io::sink())?;
    Ok(())
}

/// Whether a `Host` is this machine, at any port: one that is passed on by `ssh -L` has another number.
fn is_this_machine(host: &str) -> bool {
    let (name, port) = host.split_once(':').unwrap_or((host, "80"));
    ["127.0.0.1", "localhost"].contains(&name) && port.parse::<u16>().is_ok()
}
