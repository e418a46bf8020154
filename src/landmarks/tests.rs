//! What the page may ask and what is refused, over real connections.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;

use super::server::MOST_PAIRS;
use super::*;
use crate::error::ErrorKind;
use crate::session::stop::StopFlag;

/// A cloud of so many points, as a file.
fn cloud(path: &Path, count: usize) {
    use std::fmt::Write as _;
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         end_header\n"
    );
    for k in 0..count {
        let _ = writeln!(text, "{} {} {}", k % 10, k / 10, k * k % 7);
    }
    std::fs::write(path, text).expect("written");
}

/// Two clouds of 100 and of 120 points in a folder.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    cloud(&folder.path().join("a.ply"), 100);
    cloud(&folder.path().join("b.ply"), 120);
    folder
}

fn open(folder: &Path, given: Option<&str>, output: &str) -> Result<Picker> {
    let at = |name: &str| folder.join(name);
    let given = given.map(at);
    Picker::open(&at("a.ply"), &at("b.ply"), given.as_deref(), &at(output))
}

/// A page that is offered while `asks` runs, with its port and its path; how many pairs were saved.
fn offered(picker: Picker, asks: impl FnOnce(u16, &str)) -> Result<Option<usize>> {
    let served = picker.serve().expect("a free port");
    let address = served.address();
    let (_, path) = address
        .split_once(&format!(":{}", served.port()))
        .expect("a path");
    let stop = StopFlag::default();
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| served.wait(&stop));
        // The wait ends too where a check fails.
        let asked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            asks(served.port(), path);
        }));
        stop.set();
        if let Err(failed) = asked {
            std::panic::resume_unwind(failed);
        }
        waiting.join().expect("no panic")
    })
}

/// What comes back for bytes that are sent.
fn sent(port: u16, request: &[u8]) -> String {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
    stream.write_all(request).expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer");
    String::from_utf8(answer).expect("text")
}

/// A request as a browser sends it, with other headers behind those of a host.
fn asked(port: u16, first: &str, host: &str, more: &str, body: &str) -> String {
    let request = format!("{first} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n{body}");
    sent(port, request.as_bytes())
}

fn posted(port: u16, path: &str, body: &str) -> String {
    let host = format!("127.0.0.1:{port}");
    let more = format!(
        "Origin: http://{host}\r\nContent-Length: {}\r\n",
        body.len()
    );
    asked(port, &format!("POST {path}"), &host, &more, body)
}

#[test]
fn the_page_is_given_and_pairs_are_written_whole_or_not_at_all() {
    let folder = folder();
    let output = folder.path().join("new/pairs.csv");
    let picker = open(folder.path(), None, "new/pairs.csv").expect("opened");
    let text = "source_index,target_index\n# name: left ear\n0,119\n99,3\n";
    let saved = offered(picker, |port, path| {
        let page = asked(
            port,
            &format!("GET {path}"),
            &format!("127.0.0.1:{port}"),
            "",
            "",
        );
        assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{}", &page[..200]);
        assert!(page.contains("id=\"shapes\">{") && page.ends_with("</html>\n"));
        let pairs = format!("{path}pairs");
        let answer = posted(port, &pairs, text);
        assert!(
            answer.starts_with("HTTP/1.1 200 ") && answer.ends_with("\r\n\r\n2"),
            "{answer}"
        );
        assert_eq!(std::fs::read_to_string(&output).expect("written"), text);
        // Loaded again, the page has them.
        let host = format!("127.0.0.1:{port}");
        let page = asked(port, &format!("GET {path}"), &host, "", "");
        assert!(page.contains(r##"# name: left ear\n0,119\n99,3\n""##));
        // What is no file of pairs changes nothing.
        for (bad, why) in [
            ("0,1\n100,1\n", "pairs.csv:2: vertex 100 of "),
            ("0,1\n1,two\n", "two whole numbers"),
            ("# nothing\n", "at least 1 needed"),
        ] {
            let answer = posted(port, &pairs, bad);
            assert!(
                answer.starts_with("HTTP/1.1 422 ") && answer.contains(why),
                "{answer}"
            );
        }
        assert_eq!(std::fs::read_to_string(&output).expect("still there"), text);
    });
    assert_eq!(saved.expect("ended"), Some(2));
    let names = std::fs::read_dir(folder.path().join("new")).expect("a folder");
    assert_eq!(names.count(), 1, "no temporary file is left");
}

#[test]
fn done_ends_the_wait_and_a_stop_without_pairs_is_an_interruption() {
    let folder = folder();
    let served = open(folder.path(), None, "pairs.csv")
        .expect("opened")
        .serve();
    let served = served.expect("a free port");
    let path = served
        .address()
        .split_off(format!("http://127.0.0.1:{}", served.port()).len());
    let never = StopFlag::default();
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| served.wait(&never));
        let answer = posted(served.port(), &format!("{path}done"), "");
        assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
        assert_eq!(waiting.join().expect("no panic").expect("done"), None);
    });
    let picker = open(folder.path(), None, "pairs.csv").expect("opened");
    let error = offered(picker, |_, _| ()).expect_err("nothing was saved");
    assert_eq!(error.kind(), ErrorKind::Interruption);
    assert!(!folder.path().join("pairs.csv").exists());
}

#[test]
fn who_does_not_know_the_secret_or_comes_from_elsewhere_is_refused() {
    let folder = folder();
    let picker = open(folder.path(), None, "pairs.csv").expect("opened");
    let ended = offered(picker, |port, path| {
        let own = format!("127.0.0.1:{port}");
        let expect = |answer: String, status: &str| {
            assert!(
                answer.starts_with(&format!("HTTP/1.1 {status} ")),
                "{status}: {answer}"
            );
        };
        let get = |path: &str, host: &str| asked(port, &format!("GET {path}"), host, "", "");
        let digit = if path.as_bytes()[1] == b'0' { "1" } else { "0" };
        let other = format!("/{digit}{}", &path[2..]);
        for wrong in [
            "/",
            "/pairs",
            "",
            "//",
            &other,
            &path[..path.len() - 1],
            &path[..20],
        ] {
            expect(get(if wrong.is_empty() { "x" } else { wrong }, &own), "404");
        }
        expect(get(&format!("{path}../etc/passwd"), &own), "404");
        expect(posted(port, &format!("{other}pairs"), "0,1\n"), "404");
        // A name of someone else that leads to this machine.
        for host in [
            "evil.example",
            &format!("evil.example:{port}"),
            "",
            "127.0.0.1.evil.example:80",
        ] {
            expect(get(path, host), "403");
        }
        // As ssh passes it on.
        expect(get(path, "localhost:8000"), "200");
        let pairs = format!("POST {path}pairs");
        let body = "Content-Length: 4\r\n";
        expect(asked(port, &pairs, &own, body, "0,1\n"), "403");
        let elsewhere = format!("Origin: http://evil.example\r\n{body}");
        expect(asked(port, &pairs, &own, &elsewhere, "0,1\n"), "403");
        for method in ["PUT", "DELETE", "OPTIONS", "GET", "HEAD"] {
            expect(
                asked(port, &format!("{method} {path}pairs"), &own, "", ""),
                "405",
            );
        }
        expect(
            asked(port, &format!("POST {path}"), &own, body, "0,1\n"),
            "405",
        );
    });
    assert_eq!(
        ended.expect_err("nothing was saved").kind(),
        ErrorKind::Interruption
    );
    assert!(!folder.path().join("pairs.csv").exists());
}

#[test]
fn what_is_too_large_or_no_request_is_refused() {
    let folder = folder();
    let picker = open(folder.path(), None, "pairs.csv").expect("opened");
    let ended = offered(picker, |port, path| {
        let own = format!("127.0.0.1:{port}");
        let from = format!("Origin: http://{own}\r\n");
        let post = |more: &str| {
            let request = format!("POST {path}pairs");
            let answer = asked(port, &request, &own, &format!("{from}{more}"), "");
            answer[9..12].to_owned()
        };
        assert_eq!(
            post(&format!("Content-Length: {}\r\n", MOST_PAIRS + 1)),
            "413"
        );
        assert_eq!(post(&format!("Content-Length: {}\r\n", u128::MAX)), "411");
        assert_eq!(post(""), "411");
        assert_eq!(post("Content-Length: 4\r\nContent-Length: 5\r\n"), "411");
        assert_eq!(
            post("Content-Length: 4\r\nTransfer-Encoding: chunked\r\n"),
            "411"
        );
        assert_eq!(post("no header\r\n"), "400");
        assert_eq!(post(" folded: 1\r\n"), "400");
        for bad in [
            "GET / HTTP/1.0\r\n\r\n",
            "GET /\r\n\r\n",
            "GET / HTTP/1.1\n\n",
            "hello\r\n\r\n",
            "\r\n",
        ] {
            let answer = sent(port, bad.as_bytes());
            assert!(answer.starts_with("HTTP/1.1 400 "), "{bad:?}: {answer}");
        }
        // A head that never ends.
        let long = format!(
            "GET {path} HTTP/1.1\r\nX: {}",
            "x".repeat((16 << 10) - path.len() - 17)
        );
        assert!(sent(port, long.as_bytes()).starts_with("HTTP/1.1 400 "));
    });
    assert_eq!(
        ended.expect_err("nothing was saved").kind(),
        ErrorKind::Interruption
    );
}

#[test]
fn connections_that_say_nothing_keep_nobody_waiting() {
    let folder = folder();
    let picker = open(folder.path(), None, "pairs.csv").expect("opened");
    let ended = offered(picker, |port, path| {
        let silent = || TcpStream::connect(("127.0.0.1", port)).expect("a connection");
        let silent: Vec<TcpStream> = (0..8).map(|_| silent()).collect();
        let began = std::time::Instant::now();
        assert!(posted(port, &format!("{path}pairs"), "5,6\n").ends_with("\r\n\r\n1"));
        // Those that are silent are waited for 10 seconds.
        assert!(began.elapsed().as_secs() < 5);
        drop(silent);
    });
    assert_eq!(ended.expect("saved"), Some(1));
}

#[test]
fn what_cannot_be_read_or_written_is_said_before_the_page_is_offered() {
    let folder = folder();
    let refused = |given, output| {
        open(folder.path(), given, output)
            .expect_err("refused")
            .to_string()
    };
    let text = refused(Some("none.csv"), "pairs.csv");
    assert!(text.contains("none.csv"), "{text}");
    std::fs::write(folder.path().join("bad.csv"), "0,1\n0,120\n").expect("written");
    let text = refused(Some("bad.csv"), "pairs.csv");
    assert!(text.contains("bad.csv:2: vertex 120 of "), "{text}");
    let text = refused(None, "a.ply/pairs.csv");
    assert!(text.contains("a.ply/pairs.csv: "), "{text}");
}

#[test]
fn a_page_in_a_file_begins_with_the_pairs_given_and_does_not_send() {
    let folder = folder();
    let given = "# name: left ear\n5,6\n";
    std::fs::write(folder.path().join("given.csv"), given).expect("written");
    let picker = open(folder.path(), Some("given.csv"), "out.csv").expect("opened");
    let page = folder.path().join("page.html");
    picker.write_page(&page).expect("written");
    let html = std::fs::read_to_string(page).expect("a page");
    assert!(html.contains(r##""given":"# name: left ear\n5,6\n""##));
    assert!(html.contains(r#""output":"out.csv""#) && html.contains(r#""served":false"#));
    assert!(html.contains("connect-src 'none'"));
}

#[test]
fn pairs_that_the_page_would_read_otherwise_come_to_it_as_it_reads_them() {
    let folder = folder();
    let given = |text: &str| {
        std::fs::write(folder.path().join("given.txt"), text).expect("written");
        let picker = open(folder.path(), Some("given.txt"), "pairs.csv").expect("opened");
        picker.given.expect("pairs")
    };
    let plain = "source_index,target_index\n# name: nose\n0, 119\n99,3,0.5\n";
    assert_eq!(given(plain), plain);
    let others = [
        "# counted from 1\n1,120\n100,4\n",
        "0;119\n99;3\n",
        "0 119\n99 3\n",
    ];
    for text in others {
        assert_eq!(
            given(text),
            "source_index,target_index\n0,119\n99,3\n",
            "{text}"
        );
    }
    let sure = given("0;119;1\n99;3;0.25\n");
    assert_eq!(
        sure,
        "source_index,target_index,confidence\n0,119,1.000\n99,3,0.250\n"
    );
}
