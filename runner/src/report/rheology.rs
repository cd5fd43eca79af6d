//! What a run of soft grains found: moduli with error bars, Lissajous curves, and whether two samples differ.

use std::fmt::Write as _;

use granular::experiment::FigureEstimate;
use granular::frame::colour;
use granular::statistics::{Estimate, holm, welch};
use serde_json::Value;

use super::data::RunData;
use super::page::Section;
use super::plot::{self, Axis, escape};

const HEIGHT: f64 = 300.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 40.0;
/// Runs compared with each other at most.
const COMPARED: usize = 8;

/// Points of one colour, joined by a line.
struct Curve {
    name: String,
    ink: String,
    points: Vec<[f64; 2]>,
    /// Lowest and highest likely value of each point; empty without errors.
    interval: Vec<[f64; 2]>,
    /// Draws the intervals as a band instead of bars.
    band: bool,
}

impl Curve {
    fn new(name: impl Into<String>, rgb: [u8; 3]) -> Curve {
        let ink = format!("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
        Curve { name: name.into(), ink, points: Vec::new(), interval: Vec::new(), band: false }
    }
}

fn number(value: &Value, path: &[&str]) -> Option<f64> {
    path.iter().try_fold(value, |value, step| value.get(step))?.as_f64().filter(|x| x.is_finite())
}

fn numbers(value: &Value, name: &str) -> Vec<f64> {
    value.get(name).and_then(Value::as_array).map_or(Vec::new(), |list| list.iter().filter_map(Value::as_f64).collect())
}

fn list<'a>(value: &'a Value, name: &str) -> &'a [Value] {
    value.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// Moduli, their plot and Lissajous curves of a run; nothing for other runs.
pub(super) fn of_run(page: &mut String, run: &RunData) {
    let Some(rheology) = &run.rheology else { return };
    let headline = rheology.get("headline").and_then(Value::as_str).unwrap_or("bulk");
    let moduli = list(rheology, "moduli");
    let curves = list(rheology, "lissajous");
    let figures = figures(rheology);
    if moduli.is_empty() && curves.is_empty() && figures.is_empty() {
        return;
    }
    page.push_str("<h2>Rheology</h2>\n");
    table(page, moduli, headline);
    figure_table(page, &figures, headline);
    page.push_str("<div class=\"plots\">");
    over_time(page, run);
    let different = |name: &str| {
        let first = moduli.first().and_then(|m| number(m, &[name]));
        moduli.iter().any(|m| number(m, &[name]) != first)
    };
    for (name, label) in [("amplitude", "strain amplitude"), ("frequency", "frequency [Hz]")] {
        if different(name) {
            let mut storage = Curve::new("G′", [0, 114, 178]);
            let mut loss = Curve::new("G″", [213, 94, 0]);
            for (curve, which) in [(&mut storage, "g_prime"), (&mut loss, "g_double_prime")] {
                for m in moduli {
                    if let (Some(x), Some(y)) = (number(m, &[name]), number(m, &[headline, which, "mean"])) {
                        curve.points.push([x, y]);
                        let error = error_of(m, headline, which);
                        curve.interval.push([y - error, y + error]);
                    }
                }
            }
            let svg = chart(&[storage, loss], label, "Pa", true);
            let _ = writeln!(page, "<figure><h3>Moduli against {name}</h3>{svg}</figure>");
        }
    }
    for curve in curves {
        let strain = numbers(curve, "strain");
        let mut lines = Vec::new();
        for (name, rgb) in [("surface", colour::SURFACE), ("overall", colour::OVERALL)] {
            let mut line = Curve::new(if name == "surface" { "surface stress" } else { "overall stress" }, rgb);
            line.points = strain.iter().zip(numbers(curve, name)).map(|(x, y)| [*x, y]).collect();
            lines.push(line);
        }
        let amplitude = number(curve, &["amplitude"]).unwrap_or(f64::NAN);
        let svg = chart(&lines, "strain", "Pa", false);
        let _ = writeln!(page, "<figure><h3>Lissajous figure, last period at amplitude {amplitude}</h3>{svg}</figure>");
    }
    page.push_str("</div>\n");
}

/// Points of a curve over time at most.
const TIME_POINTS: usize = 1200;

/// Strain and the two stresses of the published plots against time, in their colours; the strain fills the height.
fn over_time(page: &mut String, run: &RunData) {
    let column = |name: &str| run.series.column(name).unwrap_or(&[]);
    let (time, phase, strain) = (column("time"), column("phase"), column("strain"));
    let stresses = [("surface stress", "surface", colour::SURFACE), ("overall stress", "overall", colour::OVERALL)];
    let columns = stresses.map(|(_, which, _)| column(&format!("shear_stress_{which}")));
    // what happens while the sample is prepared is not part of the experiment
    let first = phase.iter().position(|phase| *phase > 0.0).unwrap_or(phase.len());
    if time.len() <= first + 1 || strain.len() != time.len() || columns.iter().any(|c| c.len() != time.len()) {
        return;
    }
    let rows: Vec<usize> = (first..time.len()).step_by((time.len() - first).div_ceil(TIME_POINTS)).collect();
    let largest = |values: &[f64]| rows.iter().fold(0.0f64, |most, row| most.max(values[*row].abs()));
    let height = columns.iter().fold(0.0f64, |most, c| most.max(largest(c)));
    let reach = largest(strain);
    let curve = |name, rgb, values: &[f64], factor: f64| {
        let mut curve = Curve::new(name, rgb);
        curve.points = rows.iter().map(|row| [time[*row], values[*row] * factor]).collect();
        curve
    };
    let scale = if reach > 0.0 && height > 0.0 { height / reach } else { 1.0 };
    let mut curves = vec![curve("strain (scaled)", colour::STRAIN, strain, scale)];
    for ((name, _, rgb), values) in stresses.into_iter().zip(columns) {
        curves.push(curve(name, rgb, values, 1.0));
    }
    let svg = chart(&curves, "time [s]", "Pa", false);
    let _ = writeln!(page, "<figure><h3>Stress and strain, largest strain {reach:.3}</h3>{svg}</figure>");
}

/// Half width of the interval over samples, or the standard error of the only one.
fn error_of(moduli: &Value, measure: &str, which: &str) -> f64 {
    let figure = |name| number(moduli, &[measure, which, name]).unwrap_or(0.0);
    if figure("count") > 1.0 { figure("half_width") } else { figure("standard_error_of_a_sample") }
}

fn table(page: &mut String, moduli: &[Value], headline: &str) {
    if moduli.is_empty() {
        return;
    }
    let _ = write!(
        page,
        "<p class=\"note\">± is the half width of the 95 % interval over the samples, or the standard error over the periods of a \
         single one; the headline measure is the {headline} stress.</p><table><tr><th>Segment</th><th>Amplitude</th>\
         <th>Frequency</th><th>G′</th><th>G″</th><th>G′ by surface</th><th>G′ by overall</th></tr>"
    );
    for m in moduli {
        let cell = |measure: &str, which: &str| {
            let value = number(m, &[measure, which, "mean"]).unwrap_or(f64::NAN);
            format!("{value:.2} ± {:.2} Pa", error_of(m, measure, which))
        };
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{:.4e} Hz</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            number(m, &["segment"]).unwrap_or(0.0),
            number(m, &["amplitude"]).unwrap_or(f64::NAN),
            number(m, &["frequency"]).unwrap_or(f64::NAN),
            cell(headline, "g_prime"),
            cell(headline, "g_double_prime"),
            cell("surface", "g_prime"),
            cell("overall", "g_prime"),
        );
    }
    page.push_str("</table>\n");
}

/// What an experiment without oscillation found; empty for oscillations.
fn figures(rheology: &Value) -> Vec<FigureEstimate> {
    list(rheology, "figures").iter().filter_map(|figure| serde_json::from_value(figure.clone()).ok()).collect()
}

fn unit_of(figure: &FigureEstimate) -> &str {
    if figure.unit == "1" { "" } else { &figure.unit }
}

fn figure_table(page: &mut String, figures: &[FigureEstimate], headline: &str) {
    if figures.is_empty() {
        return;
    }
    let _ = write!(
        page,
        "<p class=\"note\">± is the half width of the 95 % interval over the samples; by the {headline} stress.</p>\
         <table><tr><th></th><th>Mean</th><th>Standard deviation</th><th>Samples</th></tr>"
    );
    for figure in figures {
        let (of, unit) = (&figure.estimate, unit_of(figure));
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{} ± {} {unit}</td><td>{} {unit}</td><td>{}</td></tr>",
            escape(&figure.name.replace('_', " ")),
            significant(of.mean),
            significant(of.half_width),
            significant(of.sd),
            of.count
        );
    }
    page.push_str("</table>\n");
}

/// Four significant digits.
fn significant(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = 3 - x.abs().log10().floor() as i32;
    if (-1..=7).contains(&digits) { format!("{x:.*}", digits.max(0) as usize) } else { format!("{x:.3e}") }
}

/// Inks that stay apart for the colour-blind.
const INKS: [[u8; 3]; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [90, 90, 90],
    [150, 120, 0],
];

/// A study: moduli of all runs against the quantity that takes most values among them, a band for each combination of the
/// others. Nothing is drawn unless a quantity takes two values.
pub(super) fn study(page: &mut String, sections: &[Section]) {
    struct Point<'a> {
        recipe: Vec<(&'a str, f64)>,
        moduli: &'a Value,
        headline: &'a str,
    }
    let points: Vec<Point<'_>> = sections
        .iter()
        .filter_map(|section| {
            let rheology = section.run.rheology.as_ref()?;
            let recipe = rheology.get("recipe")?.as_object()?;
            Some(Point {
                recipe: recipe.iter().filter_map(|(name, value)| Some((name.as_str(), value.as_f64()?))).collect(),
                moduli: list(rheology, "moduli").first()?,
                headline: rheology.get("headline")?.as_str()?,
            })
        })
        .collect();
    let Some(first) = points.first() else { return };
    let values = |name: &str| {
        let mut values: Vec<f64> =
            points.iter().filter_map(|p| p.recipe.iter().find(|r| r.0 == name).map(|r| r.1)).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let mut varied: Vec<(&str, usize)> =
        first.recipe.iter().map(|(name, _)| (*name, values(name).len())).filter(|(_, count)| *count > 1).collect();
    varied.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let Some((abscissa, _)) = varied.first().copied() else { return };
    page.push_str(
        "<h2>Study</h2>\n<p class=\"note\">First segment, headline stress; bands are 95 % bootstrap intervals of the mean over the \
         samples.</p><div class=\"plots\">",
    );
    for (which, label) in [("g_prime", "G′"), ("g_double_prime", "G″")] {
        let mut curves: Vec<Curve> = Vec::new();
        for point in &points {
            let of = |name: &str| point.recipe.iter().find(|r| r.0 == name).map(|r| r.1);
            let names: Vec<String> = varied[1..]
                .iter()
                .filter_map(|(name, _)| Some(format!("{} {}", name.replace('_', " "), of(name)?)))
                .collect();
            let name = if names.is_empty() { label.to_owned() } else { names.join(", ") };
            let (Some(x), Some(y)) = (of(abscissa), number(point.moduli, &[point.headline, which, "mean"])) else {
                continue;
            };
            let band = point.moduli[point.headline][which]["bootstrap"].as_array();
            let interval = band.and_then(|b| Some([b.first()?.as_f64()?, b.get(1)?.as_f64()?])).unwrap_or([y, y]);
            let at = curves.iter().position(|c| c.name == name).unwrap_or_else(|| {
                let mut curve = Curve::new(name, INKS[curves.len() % INKS.len()]);
                curve.band = true;
                curves.push(curve);
                curves.len() - 1
            });
            let place = curves[at].points.partition_point(|p| p[0] < x);
            curves[at].points.insert(place, [x, y]);
            curves[at].interval.insert(place, interval);
        }
        let svg = chart(&curves, &abscissa.replace('_', " "), "Pa", true);
        let _ = writeln!(page, "<figure><h3>{label} against {}</h3>{svg}</figure>", abscissa.replace('_', " "));
    }
    page.push_str("</div>\n");
}

/// What two ensembles can be compared by: figures with a spread over samples.
fn compared(rheology: &Value) -> Vec<FigureEstimate> {
    let modulus = |name: &str, shown: &str| -> Option<FigureEstimate> {
        let estimate: Estimate = serde_json::from_value(rheology.get(name)?.clone()).ok()?;
        Some(FigureEstimate { name: shown.into(), unit: "Pa".into(), estimate })
    };
    let moduli = [modulus("g_prime", "G′"), modulus("g_double_prime", "G″")];
    moduli.into_iter().flatten().chain(figures(rheology)).filter(|figure| figure.estimate.count > 1).collect()
}

/// Welch's test between all pairs of ensembles on the page, corrected for their number.
pub(super) fn comparison(page: &mut String, sections: &[Section]) {
    let ensembles: Vec<(String, Vec<FigureEstimate>)> = sections
        .iter()
        .filter_map(|section| Some((section.run.title(), compared(section.run.rheology.as_ref()?))))
        .filter(|(_, figures)| !figures.is_empty())
        .take(COMPARED)
        .collect();
    let mut pairs = Vec::new();
    for (a, first) in ensembles.iter().enumerate() {
        for second in &ensembles[a + 1..] {
            for figure in &first.1 {
                if let Some(other) = second.1.iter().find(|other| other.name == figure.name) {
                    pairs.push((&first.0, &second.0, figure, welch(&figure.estimate, &other.estimate)));
                }
            }
        }
    }
    if pairs.is_empty() {
        return;
    }
    let corrected = holm(&pairs.iter().map(|pair| pair.3.p).collect::<Vec<f64>>());
    page.push_str(
        "<h2>Comparison of samples</h2>\n<p class=\"note\">Welch's test between the means over the seeds; p is corrected for the \
         number of comparisons (Holm).</p><table><tr><th>First</th><th>Second</th><th></th><th>Difference</th><th>t</th><th>p</th></tr>",
    );
    for ((first, second, figure, test), p) in pairs.iter().zip(corrected) {
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{} {}</td><td>{:.2}</td><td>{p:.3}</td></tr>",
            escape(first),
            escape(second),
            escape(&figure.name.replace('_', " ")),
            significant(test.difference),
            unit_of(figure),
            test.t
        );
    }
    page.push_str("</table>\n");
}

fn axis(values: impl Iterator<Item = f64> + Clone, logarithmic: bool) -> Option<Axis> {
    let logarithmic = logarithmic && values.clone().all(|v| v > 0.0);
    let (low, high) = plot::range(values.map(|v| if logarithmic { v.log10() } else { v }))?;
    let margin = if high > low { 0.06 * (high - low) } else { (0.1 * high.abs()).max(1e-300) };
    Some(Axis { low: low - margin, high: high + margin, logarithmic })
}

/// A plot of curves against anything; logarithmic where asked for and possible.
fn chart(curves: &[Curve], x_label: &str, unit: &str, logarithmic: bool) -> String {
    let points = || curves.iter().flat_map(|curve| curve.points.iter());
    let reach = curves.iter().flat_map(|curve| {
        curve.points.iter().enumerate().flat_map(|(i, p)| {
            let [low, high] = curve.interval.get(i).copied().unwrap_or([p[1], p[1]]);
            // a bar that reaches below zero does not forbid logarithms
            [if low > 0.0 { low } else { p[1] }, high]
        })
    });
    let (Some(x_axis), Some(y_axis)) = (axis(points().map(|p| p[0]), logarithmic), axis(reach, logarithmic)) else {
        return String::new();
    };
    // names beside each other where they are short, below each other where they are long
    let columns = if curves.iter().any(|c| c.name.len() > 18) { 1 } else { 3 };
    let top = TOP + 14.0 * (curves.len().div_ceil(columns).saturating_sub(1)) as f64;
    let bottom = top - TOP + HEIGHT - BOTTOM;
    let x = |v: f64| LEFT + x_axis.place(v).clamp(0.0, 1.0) * (plot::WIDTH - LEFT - RIGHT);
    let y = |v: f64| {
        let place = if y_axis.logarithmic && v <= 0.0 { 0.0 } else { y_axis.place(v) };
        bottom - place.clamp(0.0, 1.0) * (bottom - top)
    };
    let mut svg = format!(
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" font-family=\"system-ui,sans-serif\" font-size=\"11\" fill=\"#444\">",
        plot::WIDTH,
        bottom + BOTTOM
    );
    for (value, label) in ticks(&y_axis, 5.0) {
        let at = y(value);
        let _ = write!(
            svg,
            "<path d=\"M{LEFT} {at:.1}H{:.1}\" stroke=\"#e4e7eb\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            plot::WIDTH - RIGHT,
            LEFT - 6.0,
            at + 4.0
        );
    }
    for (value, label) in ticks(&x_axis, 7.0) {
        let at = x(value);
        let _ = write!(
            svg,
            "<path d=\"M{at:.1} {top:.1}V{bottom:.1}\" stroke=\"#eef0f3\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
            bottom + 15.0
        );
    }
    let _ = write!(
        svg,
        "<path d=\"M{LEFT} {top:.1}V{bottom:.1}H{:.1}\" fill=\"none\" stroke=\"#8a919b\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#777\">{x_label}</text><text x=\"4\" y=\"{:.1}\" fill=\"#777\">[{unit}]</text>",
        plot::WIDTH - RIGHT,
        plot::WIDTH - RIGHT,
        bottom + 32.0,
        bottom + 15.0
    );
    for (k, curve) in curves.iter().enumerate() {
        let ink = &curve.ink;
        if curve.band {
            let there = curve.points.iter().zip(&curve.interval).map(|(p, i)| (x(p[0]), y(i[0])));
            let back = curve.points.iter().zip(&curve.interval).rev().map(|(p, i)| (x(p[0]), y(i[1])));
            let outline: Vec<String> = there.chain(back).map(|(a, b)| format!("{a:.1},{b:.1}")).collect();
            let _ = write!(svg, "<polygon points=\"{}\" fill=\"{ink}\" fill-opacity=\"0.15\"/>", outline.join(" "));
        }
        let mut path = String::new();
        for p in &curve.points {
            let _ = write!(path, "{}{:.1} {:.1}", if path.is_empty() { 'M' } else { 'L' }, x(p[0]), y(p[1]));
        }
        let _ = write!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.4\" stroke-linejoin=\"round\"/>"
        );
        for (p, interval) in curve.points.iter().zip(&curve.interval) {
            let (at, low, high) = (x(p[0]), y(interval[0]), y(interval[1]));
            let _ = write!(
                svg,
                "<path d=\"M{at:.1} {low:.1}V{high:.1}M{:.1} {low:.1}h6M{:.1} {high:.1}h6\" stroke=\"{ink}\"/><circle cx=\"{at:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"{ink}\"/>",
                at - 3.0,
                at - 3.0,
                y(p[1])
            );
        }
        let (from, line) = (LEFT + 130.0 * (k % columns) as f64, 14.0 * (k / columns) as f64);
        let _ = write!(
            svg,
            "<path d=\"M{from:.1} {:.1}h14\" stroke=\"{ink}\" stroke-width=\"2.5\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            10.0 + line,
            from + 18.0,
            14.0 + line,
            escape(&curve.name)
        );
    }
    svg.push_str("</svg>");
    svg
}

/// Ticks by value; a logarithmic axis shorter than a decade gets 1, 2 and 5.
fn ticks(axis: &Axis, wanted: f64) -> Vec<(f64, String)> {
    if !axis.logarithmic {
        return axis.ticks(wanted);
    }
    let (first, last) = (axis.low.floor() as i32, axis.high.ceil() as i32);
    let factors: &[f64] = if axis.high - axis.low > wanted { &[1.0] } else { &[1.0, 2.0, 5.0] };
    (first..=last)
        .flat_map(|e| factors.iter().map(move |f| f * 10f64.powi(e)))
        .filter(|v| (axis.low..=axis.high).contains(&v.log10()))
        .map(|v| {
            (v, if (1e-3..1e5).contains(&v) { format!("{}", (v * 1e6).round() / 1e6) } else { format!("{v:.0e}") })
        })
        .collect()
}
