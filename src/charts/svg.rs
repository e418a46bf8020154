//! The elements of a drawing as SVG.

/// Size of ordinary text.
pub(super) const TEXT: f64 = 14.0;
/// Where a text lies about its point; it is always centred in its height.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
    /// Centred and turned, to be read from below to above.
    Upwards,
}

/// A whole SVG on white.
pub(super) fn document(width: f64, height: f64, body: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

/// A line of text.
pub(super) fn text((x, y): (f64, f64), anchor: Anchor, size: f64, content: &str) -> String {
    let (word, turn) = match anchor {
        Anchor::Start => ("start", String::new()),
        Anchor::Middle => ("middle", String::new()),
        Anchor::End => ("end", String::new()),
        Anchor::Upwards => (
            "middle",
            format!(" transform=\"rotate(-90 {x:.2} {y:.2})\""),
        ),
    };
    let content = escaped(content);
    format!(
        "<text x=\"{x:.2}\" y=\"{y:.2}\" dy=\".35em\" font-size=\"{size}\" \
         text-anchor=\"{word}\"{turn}>{content}</text>\n"
    )
}

/// A thin line.
pub(super) fn path(through: &str, colour: &str) -> String {
    format!("<path d=\"{through}\" fill=\"none\" stroke=\"{colour}\"/>\n")
}

/// A filled circle.
pub(super) fn dot((x, y): (f64, f64), radius: f64) -> String {
    format!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"#0072b2\"/>\n")
}

/// The part of a drawing that lies in a rectangle.
pub(super) fn clipped((x, y): (f64, f64), (width, height): (f64, f64), body: &str) -> String {
    format!(
        "<svg x=\"{x:.2}\" y=\"{y:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" \
         viewBox=\"{x:.2} {y:.2} {width:.2} {height:.2}\">\n{body}</svg>\n"
    )
}

/// How wide a text may become in a font that is not known. Few letters of the wide ones (DejaVu,
/// Verdana) exceed 0.64 of their size on average.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    (text.chars().count() as f64 * size * 0.64).ceil()
}

/// Text as XML can hold it: control characters, which it cannot, become spaces.
fn escaped(text: &str) -> String {
    let escape = |letter: char| match letter {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '\u{fffe}' | '\u{ffff}' => " ".to_owned(),
        _ if letter.is_control() => " ".to_owned(),
        _ => letter.to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_that_xml_cannot_hold_are_written_otherwise() {
        assert_eq!(
            escaped("a<b> & \"c\"\n\u{ffff}é"),
            "a&lt;b&gt; &amp; \"c\"  é"
        );
    }
}
