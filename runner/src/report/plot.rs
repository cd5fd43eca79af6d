//! Line plots as SVG text.
//!
//! Time runs along the bottom; long series are drawn as the mean of every three pixel columns in a band from the smallest to the
//! largest value, so that a single spike stays visible.

use std::fmt::Write as _;

pub(super) const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 18.0;
const BOTTOM: f64 = 30.0;
const INK: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5236", "#6e6e78"];

/// One line of a plot.
pub(super) struct Line<'a> {
    pub name: &'a str,
    pub values: &'a [f64],
}

/// What a plot shows.
pub(super) struct Plot<'a> {
    pub time: &'a [f64],
    pub lines: Vec<Line<'a>>,
    pub unit: &'a str,
    pub logarithmic: bool,
    /// A word per row, drawn as a coloured strip under the plot.
    pub strip: &'a [String],
}

/// A position on an axis.
struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    fn place(&self, value: f64) -> f64 {
        let v = if self.logarithmic { value.log10() } else { value };
        (v - self.low) / (self.high - self.low)
    }

    fn ticks(&self, wanted: f64) -> Vec<(f64, String)> {
        if self.logarithmic {
            let stride = ((self.high - self.low) / wanted).ceil().max(1.0) as i32;
            let (first, last) = (self.low.ceil() as i32, self.high.floor() as i32);
            return (first..=last)
                .filter(|e| e.rem_euclid(stride) == 0)
                .map(|e| (f64::from(e), format!("1e{e}")))
                .collect();
        }
        let rough = (self.high - self.low) / wanted;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= rough).unwrap_or(power);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        let largest = self.low.abs().max(self.high.abs());
        (first..=last.min(first + 20)).map(|k| (k as f64 * step, number(k as f64 * step, step, largest))).collect()
    }
}

/// A tick's number with as many digits as steps of `step` need, on an axis whose largest number is `largest`.
fn number(value: f64, step: f64, largest: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if !(1e-2..1e5).contains(&largest) {
        let digits = (value.abs().log10().floor() - step.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.digits$e}")
    } else {
        let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{value:.digits$}")
    }
}

fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) =
        values.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    (low <= high).then_some((low, high))
}

/// The plot as an `<svg>` element; empty if there is nothing finite to show.
pub(super) fn svg(plot: &Plot) -> String {
    let Some((t0, t1)) = range(plot.time.iter().copied()) else { return String::new() };
    let values = || plot.lines.iter().flat_map(|line| line.values.iter().copied());
    let logarithmic = plot.logarithmic && values().any(|v| v > 0.0);
    let Some((low, high)) =
        (if logarithmic { range(values().filter(|v| *v > 0.0).map(f64::log10)) } else { range(values()) })
    else {
        return String::new();
    };
    let (low, high) = if logarithmic {
        ((low - 0.2).floor().max(high - 18.0), (high + 0.2).ceil())
    } else {
        let margin = if high > low { 0.06 * (high - low) } else { (0.5 * high.abs()).max(1e-300) };
        (low - margin, high + margin)
    };
    let y_axis = Axis { low, high, logarithmic };
    let x_axis = Axis { low: t0, high: if t1 > t0 { t1 } else { t0 + 1.0 }, logarithmic: false };
    let legend_rows = legend_layout(&plot.lines);
    let top = 10.0 + 16.0 * legend_rows.last().map_or(0.0, |l| l.1 + 1.0);
    let strip_height = if plot.strip.is_empty() { 0.0 } else { 30.0 };
    let bottom = HEIGHT - BOTTOM;
    let total = HEIGHT + strip_height;
    let x = |t: f64| LEFT + x_axis.place(t) * (WIDTH - LEFT - RIGHT);
    let y = |v: f64| bottom - y_axis.place(v).clamp(0.0, 1.0) * (bottom - top);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {total}\" role=\"img\" font-family=\"system-ui,sans-serif\" font-size=\"11\" fill=\"#444\">"
    );
    for (value, label) in y_axis.ticks(5.0) {
        let at = bottom - (value - y_axis.low) / (y_axis.high - y_axis.low) * (bottom - top);
        let _ = write!(
            svg,
            "<path d=\"M{LEFT} {at:.1}H{:.1}\" stroke=\"#e4e7eb\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            at + 4.0
        );
    }
    for (value, label) in x_axis.ticks(7.0) {
        let at = x(value);
        let _ = write!(
            svg,
            "<path d=\"M{at:.1} {top:.1}V{bottom:.1}\" stroke=\"#eef0f3\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
            bottom + 15.0
        );
    }
    let _ = write!(
        svg,
        "<path d=\"M{LEFT} {top:.1}V{bottom:.1}H{:.1}\" fill=\"none\" stroke=\"#8a919b\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#777\">time [s]</text>",
        WIDTH - RIGHT,
        WIDTH - RIGHT,
        bottom + 27.0
    );
    if !plot.unit.is_empty() {
        let _ = write!(svg, "<text x=\"4\" y=\"{:.1}\" fill=\"#777\">[{}]</text>", bottom + 15.0, plot.unit);
    }
    for (k, line) in plot.lines.iter().enumerate() {
        curve(&mut svg, INK[k % INK.len()], plot.time, line.values, logarithmic, &x, &y);
        for (t, v) in plot.time.iter().zip(line.values) {
            // What is not finite is a fault: a red mark at the foot says when.
            if !v.is_finite() {
                let _ = write!(svg, "<path d=\"M{:.1} {bottom:.1}v-8\" stroke=\"#d00\" stroke-width=\"2\"/>", x(*t));
                break;
            }
        }
        let (column, row) = legend_rows[k];
        let (lx, ly) = (LEFT + column, 12.0 + 16.0 * row);
        let _ = write!(
            svg,
            "<path d=\"M{lx:.1} {:.1}h14\" stroke=\"{}\" stroke-width=\"2.5\"/><text x=\"{:.1}\" y=\"{ly:.1}\">{}</text>",
            ly - 4.0,
            INK[k % INK.len()],
            lx + 18.0,
            escape(line.name)
        );
    }
    if !plot.strip.is_empty() {
        strip(&mut svg, plot, HEIGHT + 2.0, &x);
    }
    svg.push_str("</svg>");
    svg
}

/// Column [px] and row of every entry of the legend.
fn legend_layout(lines: &[Line]) -> Vec<(f64, f64)> {
    let (mut column, mut row) = (0.0, 0.0);
    lines
        .iter()
        .map(|line| {
            let width = 36.0 + 7.3 * line.name.chars().count() as f64;
            if column > 0.0 && column + width > WIDTH - LEFT - RIGHT {
                (column, row) = (0.0, row + 1.0);
            }
            let place = (column, row);
            column += width;
            place
        })
        .collect()
}

/// The values of a few pixel columns.
struct Column {
    at: f64,
    low: f64,
    high: f64,
    sum: f64,
    count: f64,
}

/// A line through all values or, where they are denser than pixels, the mean of every three pixel columns in a band from the
/// smallest to the largest. Gaps (values that cannot be drawn) break the line.
fn curve(
    svg: &mut String,
    ink: &str,
    time: &[f64],
    values: &[f64],
    positive: bool,
    x: &dyn Fn(f64) -> f64,
    y: &dyn Fn(f64) -> f64,
) {
    let drawable = |v: f64| v.is_finite() && (!positive || v > 0.0);
    let dense = values.len() as f64 > WIDTH - LEFT - RIGHT;
    let mut runs: Vec<Vec<Column>> = vec![Vec::new()];
    for (t, v) in time.iter().zip(values) {
        if !drawable(*v) || !t.is_finite() {
            runs.push(Vec::new());
            continue;
        }
        let at = if dense { 3.0 * (x(*t) / 3.0).floor() + 1.5 } else { x(*t) };
        let Some(run) = runs.last_mut() else { continue };
        match run.last_mut() {
            Some(column) if dense && column.at == at => {
                (column.low, column.high) = (column.low.min(*v), column.high.max(*v));
                column.sum += v;
                column.count += 1.0;
            }
            _ => run.push(Column { at, low: *v, high: *v, sum: *v, count: 1.0 }),
        }
    }
    let (mut band, mut line) = (String::new(), String::new());
    for run in runs.iter().filter(|run| !run.is_empty()) {
        for (k, column) in run.iter().enumerate() {
            let _ =
                write!(line, "{}{:.1} {:.1}", if k == 0 { 'M' } else { 'L' }, column.at, y(column.sum / column.count));
        }
        if run.iter().any(|c| y(c.low) - y(c.high) > 1.0) {
            run.iter()
                .enumerate()
                .for_each(|(k, c)| _ = write!(band, "{}{:.1} {:.1}", if k == 0 { 'M' } else { 'L' }, c.at, y(c.high)));
            run.iter().rev().for_each(|c| _ = write!(band, "L{:.1} {:.1}", c.at, y(c.low)));
            band.push('Z');
        }
    }
    if !band.is_empty() {
        let _ = write!(svg, "<path d=\"{band}\" fill=\"{ink}\" fill-opacity=\"0.3\"/>");
    }
    let _ = write!(
        svg,
        "<path d=\"{line}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.4\" stroke-linejoin=\"round\"/>"
    );
}

/// The words of every row as coloured stretches, with their shares.
fn strip(svg: &mut String, plot: &Plot, top: f64, x: &dyn Fn(f64) -> f64) {
    let mut words: Vec<(&str, usize)> = Vec::new();
    for word in plot.strip {
        match words.iter_mut().find(|(known, _)| known == word) {
            Some(entry) => entry.1 += 1,
            None => words.push((word, 1)),
        }
    }
    words.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
    let ink = |word: &str| match words.iter().position(|(known, _)| *known == word) {
        _ if word == "retry" => "#d00000",
        Some(k) => INK[k % INK.len()],
        None => "#ccc",
    };
    // Stretches that share a pixel column show the word that is rarer overall: a retry must not hide.
    let mut column: Option<(f64, &str)> = None;
    let rank = |word: &str| words.iter().position(|(known, _)| *known == word).unwrap_or(0);
    let mut marks: Vec<(f64, &str)> = Vec::new();
    for (t, word) in plot.time.iter().zip(plot.strip) {
        let at = x(*t).floor();
        match &mut column {
            Some((place, shown)) if *place == at => {
                if rank(word) > rank(shown) {
                    *shown = word;
                }
            }
            _ => {
                marks.extend(column.replace((at, word)));
            }
        }
    }
    marks.extend(column);
    for (k, (at, word)) in marks.iter().enumerate() {
        if k > 0 && marks[k - 1].1 == *word {
            continue;
        }
        // A step covers the time since the row before it.
        let from = if k > 0 { marks[k - 1].0 } else { *at };
        let end = marks[k..].iter().take_while(|m| m.1 == *word).last().map_or(*at, |m| m.0);
        let _ = write!(
            svg,
            "<rect x=\"{from:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"8\" fill=\"{}\"/>",
            (end - from).max(1.0),
            ink(word)
        );
    }
    let mut at = LEFT;
    for (word, count) in words.iter().take(5) {
        let share = 100.0 * *count as f64 / plot.strip.len() as f64;
        let share = if share < 0.5 { "<1".to_owned() } else { format!("{share:.0}") };
        let text = format!("{} {} %", escape(word), escape(&share));
        let _ = write!(
            svg,
            "<rect x=\"{at:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\" fill=\"{}\"/><text x=\"{:.1}\" y=\"{:.1}\">{text}</text>",
            top + 14.0,
            ink(word),
            at + 11.0,
            top + 22.0
        );
        at += 26.0 + 6.8 * text.chars().count() as f64;
    }
}

/// Text that cannot be taken for markup.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
