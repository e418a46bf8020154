//! Tests of charts: what the SVG holds, read as XML.

use super::testing::{legend, texts};
use super::*;

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

#[test]
fn a_chart_is_xml_and_says_its_titles_labels_and_units() {
    let points = [[0.0, 1.0], [1.0, 2.0]];
    let panels = [panel(vec![
        line("<one> & \"two\"", &points),
        line("three", &points),
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
    let points = [[0.0, 1.0], [1.0, 2.0]];
    let panels = vec![panel(vec![line("same", &points)]); 4];
    let svg = line_chart("Four", &panels).expect("a chart");
    assert_eq!(legend(&svg), ["same"]);
    assert_eq!(texts(&svg).iter().filter(|text| *text == "left").count(), 4);
}

#[test]
fn all_text_and_all_panels_lie_within_the_picture() {
    let points = [[0.0, 1.0], [1.0, 2.0]];
    let long = "a label that is much longer than what one panel is wide, twice over and more";
    let svg = line_chart(long, &[panel(vec![line(long, &points)])]).expect("a chart");
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let root = document.root_element();
    let number = |node: roxmltree::Node<'_, '_>, name: &str| -> f64 {
        node.attribute(name).expect(name).parse().expect("a number")
    };
    let width = f64::from(FINE) * number(root, "width");
    for text in document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
    {
        let size = number(text, "font-size");
        let wide = 0.64 * size * text.text().unwrap_or_default().trim().chars().count() as f64;
        let (left, right) = match (text.attribute("text-anchor"), text.attribute("transform")) {
            // Turned text is as wide as it is high.
            (_, Some(_)) => (size, size),
            (Some("middle"), _) => (wide / 2.0, wide / 2.0),
            (Some("end"), _) => (wide, 0.0),
            _ => (0.0, wide),
        };
        let x = number(text, "x");
        // The estimate of the width is rounded up to a whole unit of the picture.
        assert!(x - left >= -f64::from(FINE), "{text:?}");
        assert!(x + right <= width + f64::from(FINE), "{text:?}");
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
    let axes: Vec<Axis> = panels
        .iter()
        .map(|panel| y_axis(panel, &panels).expect("points"))
        .collect();
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
    let pieces = runs(&line("a", &points), Scale::Log);
    // log10 of a power of ten is exact.
    assert_eq!(pieces, [vec![(0.0, 0.0), (0.1, 1.0)], vec![(0.3, 2.0)]]);
}

#[test]
fn a_single_point_is_drawn() {
    let with = line_chart("One", &[panel(vec![line("a", &[[0.5, 1.0]])])]).expect("a chart");
    let circles = |svg: &str| svg.matches("<circle").count();
    assert_eq!(circles(&with), 1);
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    assert_eq!(line_chart("None", &[]), Err(ChartError::NoPanels));
    let nothing = panel(vec![line("a", &[[0.5, f64::NAN]])]);
    let refused = line_chart("None", &[nothing]).expect_err("no point");
    assert!(refused.to_string().contains("\"left\""), "{refused}");
}
