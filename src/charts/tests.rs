//! Tests of charts: what the SVG holds, read as XML.

use super::*;

/// The content of every text of an SVG with one of these anchors, in order.
fn anchored(svg: &str, anchors: &[&str]) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).expect("XML");
    let texts = document.descendants().filter(|node| {
        node.has_tag_name("text") && anchors.contains(&node.attribute("text-anchor").expect("set"))
    });
    let content = |node: roxmltree::Node<'_, '_>| node.text().unwrap_or_default().to_owned();
    texts.map(content).collect()
}

/// Every text of an SVG.
pub(crate) fn texts(svg: &str) -> Vec<String> {
    anchored(svg, &["start", "middle", "end"])
}

/// The labels of the legend: they alone start at their point, but for those of marks.
pub(crate) fn legend(svg: &str) -> Vec<String> {
    anchored(svg, &["start"])
}

fn panel(lines: Vec<Line>) -> Panel {
    Panel {
        title: "left".to_owned(),
        x_label: "share (%)".to_owned(),
        y_label: "volume (1)".to_owned(),
        lines,
        ..Panel::default()
    }
}

fn line(label: &str, points: &[[f64; 2]]) -> Line {
    Line {
        label: label.to_owned(),
        points: points.to_vec(),
        ..Line::default()
    }
}

const TWO: [[f64; 2]; 2] = [[0.0, 1.0], [1.0, 2.0]];

#[test]
fn a_chart_is_xml_and_holds_its_titles_labels_and_units() {
    let panels = [panel(vec![
        line("<one> & \"two\"", &TWO),
        line("three", &TWO),
    ])];
    let svg = line_chart("Volume <over> time", &panels).expect("a chart");
    let texts = texts(&svg);
    for expected in ["Volume <over> time", "left", "share (%)", "volume (1)"] {
        assert!(
            texts.iter().any(|text| text == expected),
            "{expected}: {texts:?}"
        );
    }
    assert_eq!(legend(&svg), ["<one> & \"two\"", "three"]);
}

#[test]
fn a_label_in_several_panels_is_in_the_legend_once() {
    let panels = vec![panel(vec![line("same", &TWO)]); 4];
    let svg = line_chart("Four", &panels).expect("a chart");
    assert_eq!(legend(&svg), ["same"]);
    assert_eq!(texts(&svg).iter().filter(|text| *text == "left").count(), 4);
}

#[test]
fn all_text_lies_within_the_picture() {
    let long = "a label that is much longer than what one panel is wide, twice over and more";
    let titled = Panel {
        title: long.to_owned(),
        ..panel(vec![line(long, &TWO)])
    };
    let svg = line_chart(long, &[titled.clone(), titled]).expect("a chart");
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let number = |node: roxmltree::Node<'_, '_>, name: &str| -> f64 {
        node.attribute(name).expect(name).parse().expect("a number")
    };
    let width = number(document.root_element(), "width");
    for text in document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
    {
        let size = number(text, "font-size");
        let wide = text_width(text.text().unwrap_or_default(), size);
        let (left, right) = match (text.attribute("text-anchor"), text.attribute("transform")) {
            // Turned text is as wide as it is high.
            (_, Some(_)) => (size / 2.0, size / 2.0),
            (Some("middle"), _) => (wide / 2.0, wide / 2.0),
            (Some("end"), _) => (wide, 0.0),
            _ => (0.0, wide),
        };
        let x = number(text, "x");
        assert!(x - left >= 0.0 && x + right <= width, "{text:?}");
    }
}

#[test]
fn panels_of_the_same_quantity_share_their_range() {
    let narrow = panel(vec![line("a", &[[0.0, 1.0], [1.0, 1.1]])]);
    let wide = panel(vec![line("a", &[[0.0, 0.0], [1.0, 9.0]])]);
    let other = Panel {
        y_label: "another quantity".to_owned(),
        ..narrow.clone()
    };
    let panels = [narrow, wide, other];
    let axes = panels
        .each_ref()
        .map(|panel| axes(panel, &panels).expect("points").1);
    assert_eq!(axes[0], axes[1]);
    assert_ne!(axes[0], axes[2]);
}

#[test]
fn a_line_is_broken_where_a_value_has_no_place_on_the_axis() {
    let points = [
        [0.0, 1.0],
        [0.1, 10.0],
        [0.2, 0.0],
        [0.3, 100.0],
        [0.4, f64::NAN],
    ];
    let panel = Panel {
        y_scale: Scale::Log,
        x_range: Some([0.0, 1.0]),
        ..panel(vec![line("a", &points)])
    };
    let svg = line_chart("Broken", &[panel]).expect("a chart");
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let is_line = |node: &roxmltree::Node<'_, '_>| node.attribute("stroke-width") == Some("2");
    let mut lines = document.descendants().filter(is_line);
    let line = lines.next_back().expect("a line");
    let outline = line.attribute("d").expect("an outline");
    // The first two points, then the fourth alone.
    assert_eq!(
        (outline.matches('M').count(), outline.matches('L').count()),
        (2, 1),
        "{outline}"
    );
    assert!(outline.ends_with("h6"), "{outline}");
}

#[test]
fn marks_alone_are_drawn_and_named_on_logarithmic_axes() {
    let mark = |label: &str, at| Mark {
        label: label.to_owned(),
        at,
    };
    let panel = Panel {
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        marks: vec![
            mark("fast", [1.0, 4.0]),
            mark("slow", [100.0, 1.0]),
            mark("none", [0.0, 1.0]),
        ],
        ..panel(vec![])
    };
    let svg = line_chart("Marks", &[panel]).expect("a chart");
    let texts = texts(&svg);
    let count = |label: &str| texts.iter().filter(|text| *text == label).count();
    // What has no place on the axis is left out.
    assert_eq!(
        [count("fast"), count("slow"), count("none")],
        [1, 1, 0],
        "{texts:?}"
    );
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let dots = document
        .descendants()
        .filter(|node| node.has_tag_name("circle"));
    let number = |node: roxmltree::Node<'_, '_>, name: &str| -> f64 {
        node.attribute(name).expect(name).parse().expect("a number")
    };
    let places: Vec<_> = dots
        .map(|dot| [number(dot, "cx"), number(dot, "cy")])
        .collect();
    assert_eq!(places.len(), 2);
    // Later to the right, larger above.
    assert!(
        places[0][0] < places[1][0] && places[0][1] < places[1][1],
        "{places:?}"
    );
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    assert_eq!(line_chart("None", &[]), Err(ChartError::NoPanels));
    for lines in [vec![], vec![line("a", &[[0.5, f64::NAN]])]] {
        let refused = line_chart("None", &[panel(lines)]).expect_err("no point");
        assert!(refused.to_string().contains("\"left\""), "{refused}");
    }
}
