//! One request of HTTP/1.1 read strictly, and one answer written: what a page of our own needs and no more.
//!
//! No connection is kept, no body comes in pieces, no header is folded. What is anything else is refused.

use std::io::{self, BufRead, Read, Write};

/// The most bytes of a request before its body.
const MOST_HEAD: u64 = 16 << 10;

/// What was asked, and how it is answered if it is refused.
#[derive(Debug)]
pub(super) struct Head {
    pub method: String,
    pub path: String,
    headers: Vec<(String, String)>,
}

/// An answer: its status, the kind of its body and the body.
#[derive(Debug, PartialEq)]
pub(super) struct Answer {
    pub status: &'static str,
    pub kind: &'static str,
    pub body: Vec<u8>,
}

impl Answer {
    /// Words for people.
    pub(super) fn text(status: &'static str, text: impl Into<String>) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            body: text.into().into_bytes(),
        }
    }

    /// Writes it, after which the connection ends.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        // No other page may show this one or read it, and nothing keeps it.
        let head = format!(
            "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: same-origin\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\n\r\n",
            self.status,
            self.kind,
            self.body.len()
        );
        out.write_all(head.as_bytes())?;
        out.write_all(&self.body)?;
        out.flush()
    }
}

impl Head {
    /// Reads a request up to its body. `None` where a connection ends before it says anything.
    pub(super) fn read(stream: &mut impl BufRead) -> Result<Option<Self>, Answer> {
        let refused = || Answer::text("400 Bad Request", "this is no request of HTTP/1.1");
        let mut left = stream.take(MOST_HEAD);
        let mut line = || -> Result<String, Answer> {
            let mut bytes = Vec::new();
            left.read_until(b'\n', &mut bytes)
                .map_err(|error| Answer::text("408 Request Timeout", error.to_string()))?;
            if bytes.is_empty() {
                return Ok(String::new());
            }
            let Some(text) = bytes.strip_suffix(b"\r\n") else {
                return Err(refused());
            };
            // With its end, so that an empty line differs from no line.
            let text = String::from_utf8(text.to_vec()).map_err(|_error| refused());
            Ok(text? + "\n")
        };
        let first = line()?;
        if first.is_empty() {
            return Ok(None);
        }
        let mut words = first.trim_end_matches('\n').split(' ');
        let (Some(method), Some(path), Some("HTTP/1.1"), None) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            return Err(refused());
        };
        let mut head = Self {
            method: method.to_owned(),
            path: path.to_owned(),
            headers: Vec::new(),
        };
        loop {
            let next = line()?;
            match next.trim_end_matches('\n') {
                "" if next.is_empty() => return Err(refused()),
                "" => return Ok(Some(head)),
                header => {
                    let (name, value) = header.split_once(':').ok_or_else(refused)?;
                    let name = name.to_ascii_lowercase();
                    if name.is_empty() || name.contains([' ', '\t']) {
                        return Err(refused());
                    }
                    head.headers.push((name, value.trim().to_owned()));
                }
            }
        }
    }

    /// The value of a header. One that is given twice is none.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(known, _)| known == name);
        let value = found.next().map(|(_, value)| value.as_str());
        value.filter(|_| found.next().is_none())
    }

    /// The body, of at most so many bytes.
    pub(super) fn body(&self, stream: &mut impl Read, most: usize) -> Result<Vec<u8>, Answer> {
        let length = self.header("content-length");
        let length: Option<usize> = length.and_then(|text| text.parse().ok());
        let Some(length) = length.filter(|_| self.header("transfer-encoding").is_none()) else {
            return Err(Answer::text("411 Length Required", "the length is needed"));
        };
        if length > most {
            let text = format!("{length} bytes, at most {most} are taken");
            return Err(Answer::text("413 Content Too Large", text));
        }
        let mut body = vec![0; length];
        stream
            .read_exact(&mut body)
            .map_err(|error| Answer::text("408 Request Timeout", error.to_string()))?;
        Ok(body)
    }
}
