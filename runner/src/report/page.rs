//! The page itself.

use std::fmt::Write as _;

use serde_json::Value;

use super::base64;
use super::data::{RunData, Table};
use super::groups;
use super::pictures::Shown;
use super::plot::{self, Line, Plot, escape};
use super::rheology;
use super::verdict::{Grade, Verdict};

/// Everything about one run.
pub(super) struct Section {
    pub run: RunData,
    pub shown: Shown,
    pub verdict: Verdict,
}

const STYLE: &str = include_str!("page.css");

pub(super) fn html(sections: &[Section]) -> String {
    let title = match sections {
        [one] => one.run.title(),
        many => format!("{} runs", many.len()),
    };
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{}</title><style>{STYLE}</style></head><body>\n",
        escape(&title)
    );
    if sections.len() > 1 {
        overview(&mut page, sections);
        rheology::study(&mut page, sections);
        rheology::comparison(&mut page, sections);
    }
    for (k, section) in sections.iter().enumerate() {
        run_section(&mut page, k, section);
    }
    page.push_str("</body></html>\n");
    page
}

fn class(grade: Grade) -> &'static str {
    match grade {
        Grade::Good => "good",
        Grade::Doubtful => "doubtful",
        Grade::Bad => "bad",
    }
}

fn overview(page: &mut String, sections: &[Section]) {
    let _ = write!(
        page,
        "<h1>{} runs</h1>\n<table class=\"overview\"><tr><th></th><th>Run</th><th>Verdict</th><th>Seconds</th></tr>",
        sections.len()
    );
    for (k, section) in sections.iter().enumerate() {
        let picture =
            section.shown.stills.last().map_or(String::new(), |(_, png)| image(png, "png", "last frame", "thumb"));
        let seconds = section
            .run
            .summary
            .as_ref()
            .and_then(|s| s.get("seconds")?.as_f64())
            .map_or(String::new(), |s| format!("{s:.1}"));
        let _ = write!(
            page,
            "<tr><td>{picture}</td><td><a href=\"#run{k}\">{}</a><br><small>{}</small></td><td><span class=\"dot {}\"></span>{}</td><td>{seconds}</td></tr>",
            escape(&section.run.title()),
            escape(&section.run.folder.display().to_string()),
            class(section.verdict.grade),
            escape(&section.verdict.headline)
        );
    }
    page.push_str("</table>\n");
}

fn image(bytes: &[u8], kind: &str, alt: &str, class: &str) -> String {
    format!(
        "<img class=\"{class}\" alt=\"{}\" src=\"data:image/{kind};base64,{}\">",
        escape(alt),
        base64::encode(bytes)
    )
}

fn run_section(page: &mut String, k: usize, section: &Section) {
    let Section { run, shown, verdict } = section;
    let _ = writeln!(page, "<section id=\"run{k}\"><h1>{}</h1>", escape(&run.title()));
    let _ = write!(
        page,
        "<div class=\"verdict {}\"><strong>{}</strong><ul>",
        class(verdict.grade),
        escape(&verdict.headline)
    );
    for (grade, text) in &verdict.findings {
        let _ = write!(page, "<li><span class=\"dot {}\"></span>{}</li>", class(*grade), escape(text));
    }
    page.push_str("</ul></div>\n");
    pictures(page, run, shown);
    rheology::of_run(page, run);
    plots(page, run);
    tables(page, run);
    page.push_str("</section>\n");
}

fn pictures(page: &mut String, run: &RunData, shown: &Shown) {
    page.push_str("<h2>Pictures</h2>\n");
    if shown.stills.is_empty() {
        page.push_str("<p class=\"note\">No frames to show.</p>\n");
        return;
    }
    page.push_str("<div class=\"stage\">");
    if let Some(gif) = &shown.animation {
        let _ = write!(
            page,
            "<figure>{}<figcaption>Animation of {} frames</figcaption></figure>",
            image(gif, "gif", "animation of the run", "wide"),
            run.frames.len()
        );
    }
    if let Some((caption, png)) = &shown.large {
        let _ = write!(
            page,
            "<figure>{}<figcaption>{}</figcaption></figure>",
            image(png, "png", caption, "wide"),
            escape(caption)
        );
    }
    for (caption, png) in &shown.cuts {
        let _ = write!(
            page,
            "<figure>{}<figcaption>{}</figcaption></figure>",
            image(png, "png", caption, "wide"),
            escape(caption)
        );
    }
    page.push_str("</div>\n<div class=\"stills\">");
    for (time, png) in &shown.stills {
        let caption = format!("{} s", short(*time));
        let bar = shown.scale_bar.map_or(String::new(), |(length, share)| {
            format!(
                "<span class=\"bar\" style=\"width:{:.1}%\"></span><span class=\"length\">{}</span>",
                100.0 * share,
                metres(length)
            )
        });
        let _ = write!(
            page,
            "<figure><div class=\"frame\">{}{bar}</div><figcaption>{caption}</figcaption></figure>",
            image(png, "png", &caption, "wide")
        );
    }
    page.push_str("</div>\n");
}

fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        format!("{}", (value * 1e6).round() / 1e6)
    } else {
        format!("{value:.3e}")
    }
}

fn metres(length: f64) -> String {
    for (unit, name) in [(1.0, "m"), (1e-2, "cm"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm")] {
        if length >= unit * 0.999 {
            return format!("{} {name}", (length / unit).round());
        }
    }
    format!("{length:.1e} m")
}

fn plots(page: &mut String, run: &RunData) {
    page.push_str("<h2>Series</h2>\n");
    let table = &run.series;
    let Some(time) = table.column("time").filter(|t| !t.is_empty()) else {
        page.push_str("<p class=\"note\">No series to show.</p>\n");
        return;
    };
    page.push_str("<div class=\"plots\">");
    let mut figure = |title: &str, svg: String, note: &str| {
        if !svg.is_empty() {
            let _ = writeln!(
                page,
                "<figure><h3>{}</h3>{svg}<figcaption>{}</figcaption></figure>",
                escape(title),
                escape(note)
            );
        }
    };
    if let Some(dt) = table.column("dt") {
        // The row of the start has no step.
        let begin = usize::from(dt.first() == Some(&0.0));
        let strip = if table.limiter.len() == dt.len() { &table.limiter[begin..] } else { &[] };
        let plot = Plot {
            time: &time[begin..],
            lines: vec![Line { name: "dt", values: &dt[begin..] }],
            unit: "s",
            logarithmic: true,
            strip,
        };
        figure("Step size and what limits it", plot::svg(&plot), "");
    }
    for group in groups::of(&table.header) {
        let mut idle = Vec::new();
        let mut lines = Vec::new();
        for &k in &group.columns {
            let (name, values) = (table.header[k].as_str(), table.columns[k].as_slice());
            if values.iter().all(|v| *v == 0.0) { idle.push(name) } else { lines.push(Line { name, values }) }
        }
        let note = if idle.is_empty() { String::new() } else { format!("always 0: {}", idle.join(", ")) };
        if lines.is_empty() {
            continue;
        }
        let plot = Plot { time, lines, unit: group.unit, logarithmic: group.logarithmic, strip: &[] };
        figure(&group.title, plot::svg(&plot), &note);
    }
    timing_plot(&mut figure, run);
    page.push_str("</div>\n");
    stages(page, &run.timings);
}

/// Seconds per step against simulated time, joined through the step number.
fn timing_plot(figure: &mut dyn FnMut(&str, String, &str), run: &RunData) {
    let (Some(steps), Some(seconds)) = (run.timings.column("step"), run.timings.column("seconds")) else { return };
    let (Some(row_steps), Some(time)) = (run.series.column("step"), run.series.column("time")) else { return };
    let mut k = 0;
    let (mut at, mut cost) = (Vec::new(), Vec::new());
    for (step, seconds) in steps.iter().zip(seconds) {
        while k < row_steps.len() && row_steps[k] < *step {
            k += 1;
        }
        if k < row_steps.len() && row_steps[k] == *step && *seconds > 0.0 {
            at.push(time[k]);
            cost.push(*seconds);
        }
    }
    let plot = Plot {
        time: &at,
        lines: vec![Line { name: "seconds per step", values: &cost }],
        unit: "s",
        logarithmic: true,
        strip: &[],
    };
    figure("Cost of a step", plot::svg(&plot), "");
}

/// Where the time went, as bars.
fn stages(page: &mut String, timings: &Table) {
    let mut spent: Vec<(&str, f64)> = Vec::new();
    for (name, values) in timings.header.iter().zip(&timings.columns) {
        if let Some(stage) = name.strip_suffix("_seconds") {
            spent.push((stage, values.iter().filter(|v| v.is_finite()).sum()));
        }
    }
    let whole: f64 = timings.column("seconds").map_or(0.0, |v| v.iter().filter(|v| v.is_finite()).sum());
    if whole <= 0.0 {
        return;
    }
    let listed: f64 = spent.iter().map(|s| s.1).sum();
    spent.push(("everything else", (whole - listed).max(0.0)));
    let _ = write!(page, "<h2>Where the time went</h2>\n<p>{whole:.3} s in all steps</p><table class=\"bars\">");
    for (stage, seconds) in spent {
        let share = 100.0 * seconds / whole;
        let _ = write!(
            page,
            "<tr><th>{}</th><td>{seconds:.3} s</td><td>{share:.1} %</td><td class=\"long\"><div style=\"width:{share:.1}%\"></div></td></tr>",
            escape(stage)
        );
    }
    page.push_str("</table>\n");
}

fn tables(page: &mut String, run: &RunData) {
    page.push_str("<div class=\"tables\">");
    for (title, map) in [("Summary", &run.summary), ("Provenance", &run.provenance)] {
        let _ = write!(page, "<div><h2>{title}</h2>");
        match map {
            None => page.push_str("<p class=\"note\">Not there: the run is unfinished or was cut short.</p>"),
            Some(map) => {
                page.push_str("<table>");
                for (name, value) in map {
                    let _ = write!(page, "<tr><th>{}</th><td>{}</td></tr>", escape(name), escape(&shown_value(value)));
                }
                page.push_str("</table>");
            }
        }
        page.push_str("</div>");
    }
    page.push_str("</div>\n");
    if let Some(scene) = &run.scene {
        let _ = writeln!(page, "<details><summary>Scene as run</summary><pre>{}</pre></details>", escape(scene));
    }
    let _ = writeln!(page, "<p class=\"note\">{}</p>", escape(&run.folder.display().to_string()));
}

fn shown_value(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "–".to_owned(),
        Value::Array(list) => list.iter().map(shown_value).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}
