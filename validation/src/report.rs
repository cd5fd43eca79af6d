//! A page with every case of a run: verdicts, measured values beside their references, tables and figures.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use kuva::prelude::*;

use crate::case::{Curve, Table};
use crate::run::CaseResult;

const COLORS: [&str; 8] = ["#1f5fa8", "#c8502d", "#2d8a4e", "#8250a8", "#a07d1e", "#2a8c96", "#b0407a", "#5a5a5a"];

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}\
h2{margin-top:2em;border-bottom:1px solid #ddd}table{border-collapse:collapse;margin:.6em 0}\
td,th{padding:.15em .7em;border-bottom:1px solid #e5e5e5;text-align:left}.ok{color:#2d8a4e}.bad{color:#c0392b;font-weight:600}\
.skip{color:#888}svg{max-width:100%;height:auto}";

/// Writes the page.
///
/// # Errors
/// When the file cannot be written.
pub fn write(results: &[CaseResult], path: &Path) -> io::Result<()> {
    runner::record::folder::write_atomically(path, html(results).as_bytes())
}

/// The page as text: no script, no network.
#[must_use]
pub fn html(results: &[CaseResult]) -> String {
    let mut page = String::new();
    let _ = write!(
        page,
        "<!doctype html><html lang=en><meta charset=utf-8><title>Validation</title><style>{STYLE}</style>"
    );
    let passed = results.iter().filter(|r| r.outcome.passed()).count();
    let skipped = results.iter().filter(|r| r.outcome.skipped().is_some()).count();
    let failed = results.len() - passed - skipped;
    let _ = write!(page, "<h1>Validation</h1><p>{passed} passed, {failed} failed, {skipped} skipped.</p><table>");
    for result in results {
        let (class, word) = verdict(result);
        let _ = write!(
            page,
            "<tr><td class={class}>{word}<td><a href=\"#{0}\">{0}</a><td>{1:.2} s",
            result.case, result.seconds
        );
    }
    page.push_str("</table>");
    for result in results {
        section(&mut page, result);
    }
    page
}

fn verdict(result: &CaseResult) -> (&'static str, &'static str) {
    if result.outcome.skipped().is_some() {
        ("skip", "skipped")
    } else if result.outcome.passed() {
        ("ok", "passed")
    } else {
        ("bad", "FAILED")
    }
}

fn section(page: &mut String, result: &CaseResult) {
    let (class, word) = verdict(result);
    let _ = write!(page, "<h2 id=\"{0}\">{0} <small class={class}>{word}</small></h2>", result.case);
    if let Some(reason) = result.outcome.skipped() {
        let _ = write!(page, "<p>{}", escape(reason));
    }
    let json = result.to_json();
    let params: Vec<String> = result.params.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    if !params.is_empty() {
        let _ = write!(page, "<p>{}", escape(&params.join(", ")));
    }
    page.push_str("<table><tr><th>measure<th>measured<th>reference<th>error<th>tolerance");
    if let Some(measured) = json["measured"].as_object() {
        for (name, value) in measured {
            let cell = |kind: &str| match json[kind].get(name) {
                Some(serde_json::Value::Number(x)) => x.as_f64().map_or_else(String::new, |x| format!("{x:.6e}")),
                Some(other) => other.to_string(),
                None => String::new(),
            };
            let shown = value.as_f64().map_or_else(|| value.to_string(), |x| format!("{x:.8e}"));
            let name = escape(name);
            let _ = write!(
                page,
                "<tr><td>{name}<td>{shown}<td>{}<td>{}<td>{}",
                cell("reference"),
                cell("error"),
                cell("tolerance")
            );
        }
    }
    page.push_str("</table>");
    if let Some(why) = json["why"].as_str() {
        let _ = write!(page, "<p>{}", escape(why));
    }
    for note in &result.outcome.notes {
        let _ = write!(page, "<p>{}", escape(note));
    }
    for content in &result.outcome.tables {
        table(page, content);
    }
    for figure in &result.outcome.curves {
        page.push_str(&curve(figure));
    }
}

fn table(page: &mut String, table: &Table) {
    let _ = write!(page, "<h4>{}</h4><table><tr>", escape(&table.title));
    for column in &table.columns {
        let _ = write!(page, "<th>{}", escape(column));
    }
    for row in &table.rows {
        page.push_str("<tr>");
        for cell in row {
            let _ = write!(page, "<td>{}", escape(cell));
        }
    }
    page.push_str("</table>");
}

/// A figure as SVG. Points that cannot stand on a logarithmic axis are left out.
#[must_use]
pub fn curve(figure: &Curve) -> String {
    let shows = |p: &&[f64; 2]| {
        p.iter().all(|x| x.is_finite()) && (!figure.log_x || p[0] > 0.0) && (!figure.log_y || p[1] > 0.0)
    };
    let mut plots: Vec<Plot> = Vec::new();
    for (place, (name, points)) in figure.series.iter().enumerate() {
        let points: Vec<(f64, f64)> = points.iter().filter(shows).map(|p| (p[0], p[1])).collect();
        if points.is_empty() {
            continue;
        }
        let color = COLORS[place % COLORS.len()];
        let marks = ScatterPlot::new().with_data(points.clone()).with_color(color).with_size(3.0);
        let line = LinePlot::new().with_data(points).with_color(color).with_legend(name.clone());
        plots.push(line.into());
        plots.push(marks.into());
    }
    if plots.is_empty() {
        return format!("<p>{}: no points", escape(&figure.title));
    }
    let mut layout = Layout::auto_from_plots(&plots)
        .with_title(figure.title.clone())
        .with_x_label(figure.x_label.clone())
        .with_y_label(figure.y_label.clone())
        .with_width(720.0)
        .with_height(420.0);
    if figure.log_x {
        layout = layout.with_log_x();
    }
    if figure.log_y {
        layout = layout.with_log_y();
    }
    render_to_svg(plots, layout)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Outcome;

    #[test]
    fn the_page_shows_verdict_figures_and_escaped_text() {
        let mut outcome = Outcome::new();
        outcome.compare("tip_x", 1.1, 1.0, 0.01);
        outcome.note("a < b");
        outcome.curve(Curve {
            title: "error against cost".into(),
            x_label: "seconds".into(),
            y_label: "error".into(),
            log_x: true,
            log_y: true,
            series: vec![("euler".into(), vec![[1e-3, 1e-1], [1e-2, 1e-2], [1e-1, 0.0]])],
        });
        let result = CaseResult { case: "a/b", params: serde_json::Map::new(), outcome, seconds: 0.1 };
        let page = html(&[result]);
        assert!(page.contains("1 failed") && page.contains("a &lt; b") && page.contains("<svg"));
    }
}
