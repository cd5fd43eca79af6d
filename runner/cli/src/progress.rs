//! What a person sees while a run goes on: a bar on a terminal, JSON lines for programs, nothing elsewhere.

use crate::out::tell;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use runner::run::{Observer, Progress};
use serde_json::json;

/// Picks the observer for this process.
pub fn observer(json_lines: bool, title: &str) -> Box<dyn Observer> {
    if json_lines {
        Box::new(JsonLines { last: None })
    } else if std::io::stderr().is_terminal() {
        Box::new(Bar::new(title))
    } else {
        Box::new(Quiet)
    }
}

/// Notes go to standard error, progress nowhere.
struct Quiet;

impl Observer for Quiet {
    fn progress(&mut self, _: &Progress) {}
    fn note(&mut self, text: &str) {
        tell!("{text}");
    }
}

struct Bar {
    bar: ProgressBar,
    drawn: Option<Instant>,
}

const BAR_PARTS: u64 = 10_000;

impl Bar {
    fn new(title: &str) -> Bar {
        let bar = ProgressBar::new(BAR_PARTS);
        let style = ProgressStyle::with_template("{prefix} {bar:30} {percent:>3} %  {msg}  {elapsed} (eta {eta})");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(title.to_owned());
        Bar { bar, drawn: None }
    }
}

impl Observer for Bar {
    fn progress(&mut self, p: &Progress) {
        let now = Instant::now();
        if self.drawn.is_some_and(|drawn| now - drawn < Duration::from_millis(80)) && p.time < p.end {
            return;
        }
        self.drawn = Some(now);
        self.bar.set_position((p.time / p.end * BAR_PARTS as f64) as u64);
        let rejected = if p.rejected > 0 { format!(", {} rejected", p.rejected) } else { String::new() };
        self.bar.set_message(format!(
            "t = {:.4} s, step {} of {:.2e} s ({}), {} iterations{rejected}",
            p.time, p.step, p.dt, p.limiter, p.iterations
        ));
    }

    fn note(&mut self, text: &str) {
        self.bar.println(text);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.abandon();
    }
}

struct JsonLines {
    last: Option<Instant>,
}

impl Observer for JsonLines {
    fn progress(&mut self, p: &Progress) {
        let now = Instant::now();
        if self.last.is_some_and(|last| now - last < Duration::from_millis(250)) && p.time < p.end {
            return;
        }
        self.last = Some(now);
        let eta = if p.time > 0.0 { p.seconds * (p.end - p.time) / p.time } else { 0.0 };
        line(&json!({
            "time": p.time, "end": p.end, "step": p.step, "dt": p.dt, "limiter": p.limiter,
            "iterations": p.iterations, "rejected": p.rejected, "seconds": p.seconds, "eta": eta,
        }));
    }

    fn note(&mut self, text: &str) {
        line(&json!({ "note": text }));
    }
}

fn line(value: &serde_json::Value) {
    let mut out = std::io::stdout().lock();
    // a reader that went away is no reason to lose a run
    let _ = writeln!(out, "{value}").and_then(|()| out.flush());
}
