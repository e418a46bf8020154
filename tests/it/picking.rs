//! `pick`: what it says and refuses, and a page that saves and ends it. `scripts/pick_test.mjs` has the page itself.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Stdio;

use crate::support::mesh::Mesh;
use crate::support::ply;
use crate::support::workplace::Workplace;

fn place() -> Workplace {
    let place = Workplace::new();
    let sphere = Mesh::sphere(1.0, 3);
    place.write("a.ply", ply::text(&sphere));
    place.write(
        "b.ply",
        ply::text(&sphere.map(|x| [x[0] + 1.0, x[1], x[2]])),
    );
    place
}

/// Sends a request of the page to its address; the answer.
fn posted(address: &str, what: &str, body: &str) -> String {
    let rest = address.strip_prefix("http://").expect("an address");
    let (host, path) = rest.split_once('/').expect("a path");
    let mut stream = TcpStream::connect(host).expect("a connection");
    let length = body.len();
    write!(
        stream,
        "POST /{path}{what} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: {length}\r\n\r\n{body}"
    )
    .expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer
}

#[test]
fn pairs_that_the_page_sends_are_saved_and_done_ends_the_command() {
    let place = place();
    // Without a display no browser is opened, and one line says where the page is.
    let mut child = place
        .command(&["pick", "a.ply", "b.ply", "-o", "new/pairs.csv"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WSL_DISTRO_NAME")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut out = BufReader::new(child.stdout.take().expect("standard output"));
    let mut address = String::new();
    out.read_line(&mut address).expect("an address");
    let address = address.trim().to_owned();
    assert!(address.starts_with("http://127.0.0.1:"), "{address}");
    let answer = posted(&address, "pairs", "0,1\n2,3\n");
    assert!(answer.ends_with("\r\n\r\n2"), "{answer}");
    let answer = posted(&address, "pairs", "0,99999\n");
    assert!(
        answer.contains("new/pairs.csv:1: vertex 99999 of b.ply"),
        "{answer}"
    );
    posted(&address, "done", "");
    let mut rest = String::new();
    out.read_to_string(&mut rest).expect("text");
    let ended = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(0), "{said}");
    assert_eq!(rest, "new/pairs.csv\n");
    if cfg!(all(unix, not(target_os = "macos"))) {
        let line = said.lines().next().unwrap_or_default();
        let parts = [
            "no browser was opened (this machine has no display)",
            &address,
            "--page",
        ];
        assert!(parts.iter().all(|part| line.contains(part)), "{said}");
    }
    assert!(
        said.contains("isomorph morph a.ply b.ply --pairs new/pairs.csv"),
        "{said}"
    );
    assert_eq!(
        fs::read_to_string(place.path("new/pairs.csv")).expect("pairs"),
        "0,1\n2,3\n"
    );
}

#[test]
fn what_cannot_be_read_written_or_would_be_lost_is_refused_first() {
    let place = place();
    let pick = |arguments: &[&str]| place.isomorph(&[&["pick"], arguments].concat());
    place.write("pairs.csv", "0,1\n");
    place.write("bad.csv", "0,1\n1\n");
    place.write("none.ply", "not a mesh");
    pick(&["a.ply", "none.ply", "-o", "x.csv"]).refused(1, &["none.ply"]);
    pick(&["a.ply", "missing.ply", "-o", "x.csv"]).refused(1, &["missing.ply"]);
    pick(&["a.ply", "b.ply", "-o", "a.ply/x.csv"]).refused(1, &["a.ply/x.csv"]);
    pick(&["a.ply", "b.ply", "--pairs", "bad.csv"]).refused(1, &["bad.csv:2: "]);
    let kept = [
        "pairs.csv: exists already",
        "--pairs pairs.csv",
        "-o",
        "--force",
    ];
    pick(&["a.ply", "b.ply"]).refused(2, &kept);
    pick(&["a.ply", "b.ply", "--pairs", "bad.csv", "-o", "pairs.csv"]).refused(2, &kept);
    assert_eq!(
        place.names(),
        ["a.ply", "b.ply", "bad.csv", "none.ply", "pairs.csv"]
    );
}

#[test]
fn a_page_is_written_as_a_file_with_the_pairs_given() {
    let place = place();
    place.write("pairs.csv", "0,1\n");
    let page = [
        "pick",
        "a.ply",
        "b.ply",
        "--pairs",
        "pairs.csv",
        "--page",
        "page.html",
    ];
    let ended = place.isomorph(&page).succeeded();
    assert_eq!(ended.stdout, "page.html\n");
    let html = fs::read_to_string(place.path("page.html")).expect("a page");
    assert!(html.contains(r#""given":"0,1\n""#) && html.contains("connect-src 'none'"));
}
