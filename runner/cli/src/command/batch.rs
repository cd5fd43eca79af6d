//! `viscose batch SCENE…`: many scenes overnight, each in a process of its own.
//!
//! A crash of one scene cannot touch another. What is done is skipped, what was cut short goes on from its checkpoint.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, IsTerminal};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic, WrapErr};
use serde_json::{Map, Value};

use super::Exit;
use super::run::read_json;
use crate::out::say;
use crate::stop;

/// Arguments of `viscose batch`.
#[derive(Args)]
pub struct Batch {
    /// Scene files, or folders of scene files.
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Scenes at the same time; the cores are shared among them.
    #[arg(short, long, default_value_t = 1)]
    pub jobs: usize,
    /// Folder under which each scene gets its own.
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Override a field in every scene.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub set: Vec<String>,
    /// Stop each scene after this much wall-clock time [s]; it can be resumed.
    #[arg(long, value_name = "SECONDS")]
    pub wall_limit: Option<f64>,
    /// Do not write the report page.
    #[arg(long)]
    pub no_report: bool,
}

/// One scene of the batch and how it went.
struct Row {
    scene: PathBuf,
    folder: PathBuf,
    verdict: &'static str,
    message: String,
    summary: Map<String, Value>,
}

impl Batch {
    /// Runs all scenes; exit code 1 if any failed, 2 if none failed but some were bad input.
    pub fn run(self) -> miette::Result<Exit> {
        let scenes = collect(&self.scenes)?;
        let names = distinct_names(&scenes)?;
        std::fs::create_dir_all(&self.out).into_diagnostic().wrap_err_with(|| self.out.display().to_string())?;
        let stop = stop::arm();
        let queue: Mutex<VecDeque<usize>> = Mutex::new((0..scenes.len()).collect());
        let rows: Mutex<Vec<(usize, Row)>> = Mutex::new(Vec::new());
        let bars = MultiProgress::new();
        let jobs = self.jobs.clamp(1, scenes.len().max(1));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = (cores / jobs).max(1);
        std::thread::scope(|scope| {
            for _ in 0..jobs {
                scope.spawn(|| {
                    while let Some(index) = next(&queue, stop) {
                        let folder = self.out.join(&names[index]);
                        let row = self.one(&scenes[index], folder, threads, &bars, stop);
                        let line = format!("{:9} {}  {}", row.verdict, row.scene.display(), row.message);
                        if std::io::stderr().is_terminal() {
                            let _ = bars.println(line);
                        } else {
                            say!("{line}");
                        }
                        lock(&rows).push((index, row));
                    }
                });
            }
        });
        let mut rows = rows.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        rows.sort_by_key(|(index, _)| *index);
        let rows: Vec<Row> = rows.into_iter().map(|(_, row)| row).collect();
        let table = self.out.join("results.csv");
        runner::record::folder::write_atomically(&table, results_csv(&rows).as_bytes()).into_diagnostic()?;
        say!("{}", table.display());
        if !self.no_report {
            let runs: Vec<PathBuf> = rows
                .iter()
                .filter(|row| row.folder.join("series.csv").exists())
                .map(|row| row.folder.clone())
                .collect();
            if !runs.is_empty() {
                let page = self.out.join("report.html");
                runner::report::write(&runs, &page)?;
                say!("{}", page.display());
            }
        }
        let count = |verdict: &str| rows.iter().filter(|row| row.verdict == verdict).count();
        let (failed, bad) = (count("failed") + count("crashed"), count("bad input"));
        say!(
            "{} scenes: {} done, {} already done, {} stopped, {failed} failed, {bad} bad input",
            scenes.len(),
            count("done"),
            count("kept"),
            count("stopped") + (scenes.len() - rows.len()),
        );
        Ok(match (failed, bad) {
            (0, 0) => Exit::Done,
            (0, _) => Exit::BadInput,
            _ => Exit::Failed,
        })
    }

    fn one(&self, scene: &Path, folder: PathBuf, threads: usize, bars: &MultiProgress, stop: &AtomicBool) -> Row {
        let row = |verdict, message: String, folder: PathBuf| {
            let summary = read_json(&folder.join("summary.json")).ok().and_then(|value| value.as_object().cloned());
            Row { scene: scene.to_owned(), folder, verdict, message, summary: summary.unwrap_or_default() }
        };
        let loaded = match runner::scene::load(scene, &self.set) {
            Ok(loaded) => loaded,
            Err(error) => return row("bad input", first_line(&error.to_string()), folder),
        };
        let same_scene = read_json(&folder.join("provenance.json"))
            .is_ok_and(|provenance| provenance["scene_hash"] == loaded.hash.clone());
        let status = read_json(&folder.join("summary.json")).ok().map(|summary| summary["status"].clone());
        if same_scene && status == Some(Value::from("completed")) {
            return row("kept", "completed before".into(), folder);
        }
        let bar = bars.add(ProgressBar::new(1000));
        if let Ok(style) = ProgressStyle::with_template("{prefix:24!} {bar:30} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        bar.set_prefix(scene.file_stem().unwrap_or_default().to_string_lossy().into_owned());
        let result = self.spawn(scene, &folder, threads, same_scene).map(|child| follow(child, &bar, stop));
        bar.finish_and_clear();
        match result {
            Err(error) => row("crashed", error.to_string(), folder),
            Ok((code, errors)) => {
                let stopped = read_json(&folder.join("summary.json")).is_ok_and(|s| s["status"] == "stopped");
                match code {
                    Some(0) if stopped => row("stopped", first_line(&errors), folder),
                    Some(0) => row("done", String::new(), folder),
                    Some(1) => row("failed", first_line(&errors), folder),
                    Some(2) => row("bad input", first_line(&errors), folder),
                    other => row("crashed", format!("{} {}", crash(other), first_line(&errors)), folder),
                }
            }
        }
    }

    fn spawn(&self, scene: &Path, folder: &Path, threads: usize, same_scene: bool) -> std::io::Result<Child> {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("run").arg(scene).arg("--out").arg(folder).args(["--json-progress", "--stop-with-input"]);
        command.args(["--threads", &threads.to_string()]);
        let holds_a_run = runner::record::folder::RunFolder::at(folder).holds_a_run();
        match (holds_a_run, same_scene) {
            (true, true) => command.arg("--resume"),
            (true, false) => command.arg("--force"),
            (false, _) => &mut command,
        };
        for set in &self.set {
            command.args(["--set", set]);
        }
        if let Some(limit) = self.wall_limit {
            command.args(["--wall-limit", &limit.to_string()]);
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn next(queue: &Mutex<VecDeque<usize>>, stop: &AtomicBool) -> Option<usize> {
    if stop.load(Ordering::Relaxed) { None } else { lock(queue).pop_front() }
}

/// Reads the child's progress until it ends. On Ctrl-C the terminal sends the signal to the child too: it stops by itself.
fn follow(mut child: Child, bar: &ProgressBar, stop: &AtomicBool) -> (Option<i32>, String) {
    // held open as long as this process lives: the child stops when it ends
    let _held = child.stdin.take();
    let errors = child.stderr.take();
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        if let Some(errors) = errors {
            for line in BufReader::new(errors).lines().map_while(Result::ok) {
                text.push_str(&line);
                text.push('\n');
            }
        }
        text
    });
    if let Some(out) = child.stdout.take() {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            let Ok(progress) = serde_json::from_str::<Value>(&line) else { continue };
            if let (Some(time), Some(end)) = (progress["time"].as_f64(), progress["end"].as_f64()) {
                bar.set_position((time / end * 1000.0) as u64);
                let limiter = progress["limiter"].as_str().unwrap_or("");
                bar.set_message(format!("t = {time:.4} s, step {} ({limiter})", progress["step"]));
            }
        }
    }
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status.code(),
            Ok(None) => std::thread::sleep(Duration::from_millis(if stop.load(Ordering::Relaxed) { 20 } else { 50 })),
            Err(_) => break None,
        }
    };
    (status, reader.join().unwrap_or_default())
}

fn crash(code: Option<i32>) -> String {
    code.map_or_else(|| "ended by a signal;".to_owned(), |code| format!("ended with code {code};"))
}

fn first_line(text: &str) -> String {
    text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or("").to_owned()
}

/// Scene files, folders replaced by the scenes in them in name order.
fn collect(paths: &[PathBuf]) -> miette::Result<Vec<PathBuf>> {
    let mut scenes = Vec::new();
    for path in paths {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).into_diagnostic().wrap_err_with(|| path.display().to_string())?;
            let mut inside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
            inside.retain(|file| file.extension().is_some_and(|e| e == "ron"));
            inside.sort();
            if inside.is_empty() {
                return Err(miette::miette!("{} holds no scene files (*.ron)", path.display()));
            }
            scenes.extend(inside);
        } else {
            scenes.push(path.clone());
        }
    }
    Ok(scenes)
}

/// A folder name for every scene: its file name, with its folder's before it where two are the same.
fn distinct_names(scenes: &[PathBuf]) -> miette::Result<Vec<String>> {
    let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let long = |path: &PathBuf| {
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
        format!("{folder}-{}", stem(path))
    };
    let mut names = Vec::new();
    for scene in scenes {
        let alone = scenes.iter().filter(|other| stem(other) == stem(scene)).count() == 1;
        let name = if alone { stem(scene) } else { long(scene) };
        if names.contains(&name) {
            return Err(miette::miette!("two scenes would write to the folder `{name}`; run them in separate batches"));
        }
        names.push(name);
    }
    Ok(names)
}

fn results_csv(rows: &[Row]) -> String {
    const FIGURES: [&str; 12] = [
        "status",
        "time",
        "steps",
        "rejected_steps",
        "mass_defect",
        "momentum_defect",
        "liquid_mass_defect",
        "g_prime",
        "g_prime_sd",
        "g_double_prime",
        "g_double_prime_sd",
        "seconds",
    ];
    let mut text = format!("scene,folder,verdict,{},message\n", FIGURES.join(","));
    let quote = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    for row in rows {
        let figure = |name: &&str| match row.summary.get(*name) {
            Some(Value::String(text)) => text.clone(),
            Some(Value::Null) | None => String::new(),
            Some(value) => value.to_string(),
        };
        let figures: Vec<String> = FIGURES.iter().map(figure).collect();
        let (scene, folder) = (row.scene.display().to_string(), row.folder.display().to_string());
        text += &format!(
            "{},{},{},{},{}\n",
            quote(&scene),
            quote(&folder),
            row.verdict,
            figures.join(","),
            quote(&row.message)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_file_names_are_told_apart_by_their_folders() {
        let scenes = ["a/x.ron", "b/x.ron", "b/y.ron"].map(PathBuf::from);
        assert_eq!(distinct_names(&scenes).unwrap(), ["a-x", "b-x", "y"]);
        assert!(distinct_names(&["a/x.ron", "c/a/x.ron"].map(PathBuf::from)).is_err());
    }
}
