//! From files and overrides to a checked scene.

use super::edit::{Path, edit_for, follow, write};
use super::error::{Problem, ProblemKind, SceneError, SourceFile};
use super::field::{Field, Reading};
use super::quantity::{Spec, Units};
use super::tree::{Entry, Group, Node, Span, Value, parse};
use super::{Scene, checks};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path as FilePath, PathBuf};

/// A scene ready to run, with everything needed to say exactly what it was.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The scene, in SI.
    pub scene: Scene,
    /// The text as run: after overrides, and with included files merged in. Loading it again gives the same scene.
    pub text: String,
    /// Name without folder and ending; names the output folder.
    pub name: String,
    /// Folder against which relative file names in `text` are resolved.
    pub folder: PathBuf,
    /// Every file read: the scene, included files, meshes and polylines.
    pub files: Vec<PathBuf>,
    /// Hash of `text`, 16 hexadecimal digits (FNV-1a, 64 bits).
    pub hash: String,
}

/// Loads a scene file and applies overrides of the form `path=value`.
///
/// # Errors
/// Every problem found, with its place and what to write instead.
pub fn load(path: impl AsRef<FilePath>, overrides: &[String]) -> Result<LoadedScene, SceneError> {
    let path = path.as_ref();
    let name = path.display().to_string();
    match read_text(path) {
        Ok(text) => load_text(&text, path, overrides),
        Err(error) => {
            let problem =
                Problem::new(ProblemKind::File, format!("cannot read the scene {name}: {error}"), Span::NONE, &[]);
            Err(SceneError::new(name, vec![problem.help("give the path of a `.ron` scene file")]))
        }
    }
}

/// Loads a scene from text. `name` is shown in messages; relative file names are resolved against its folder.
///
/// # Errors
/// As [`load`].
pub fn load_str(text: &str, name: impl AsRef<FilePath>, overrides: &[String]) -> Result<LoadedScene, SceneError> {
    load_text(text, name.as_ref(), overrides)
}

/// Reads a regular file (no device, no folder).
fn read_text(path: &FilePath) -> Result<String, String> {
    match std::fs::metadata(path) {
        Ok(data) if !data.is_file() => Err("it is not a file".to_owned()),
        Ok(_) => std::fs::read_to_string(path).map_err(|error| error.to_string()),
        Err(error) => Err(error.to_string()),
    }
}

/// One name for one file, however it was reached.
fn identity(path: &FilePath) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// The text of every file by the path under which it was asked for; edited by overrides.
type Texts = BTreeMap<PathBuf, Result<String, String>>;

/// The files of a scene, merged.
struct Merged {
    files: Vec<SourceFile>,
    paths: Vec<PathBuf>,
    root: Node,
}

fn load_text(text: &str, path: &FilePath, overrides: &[String]) -> Result<LoadedScene, SceneError> {
    let shown = path.display().to_string();
    let fail = |problems| SceneError::new(shown.clone(), problems);
    let mut texts = Texts::from([(path.to_owned(), Ok(text.to_owned()))]);
    let mut merged = merge(path, &mut texts).map_err(fail)?;

    let mut changed = Vec::new();
    for order in overrides {
        apply(order, &merged, &mut texts, &mut changed).map_err(|problem| fail(vec![problem]))?;
        let note = |problems: Vec<Problem>| fail(problems.into_iter().map(|p| p.note(&in_override(order))).collect());
        merged = merge(path, &mut texts).map_err(note)?;
    }

    let units = units_of(&merged.root);
    let mut reading = Reading::new(&merged.files, units);
    let scene = Scene::decode(&merged.root, &Spec::PLAIN, &mut reading);
    let mut problems = reading.problems;
    let mut files = merged.paths.clone();
    if let Some(scene) = &scene
        && problems.is_empty()
    {
        problems = checks::check(scene, &merged.root, &merged.files);
        files.extend(checks::external_files(scene));
    }
    match scene {
        Some(scene) if problems.is_empty() => {
            let text = if merged.files.len() == 1 { merged.files[0].text.clone() } else { merged_text(&merged) };
            Ok(LoadedScene {
                scene,
                hash: hash(&text),
                text,
                name: path.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned()),
                folder: path.parent().map(FilePath::to_owned).unwrap_or_default(),
                files,
            })
        }
        _ => Err(fail(problems.into_iter().map(|problem| name_override(problem, &merged.paths, &changed)).collect())),
    }
}

fn in_override(order: &str) -> String {
    format!("this comes from `--set {order}`")
}

/// A stretch of text that an override wrote.
struct Changed<'a> {
    file: PathBuf,
    start: usize,
    end: usize,
    order: &'a str,
}

/// Adds the override to a problem that lies inside the text it wrote.
fn name_override(problem: Problem, paths: &[PathBuf], changed: &[Changed<'_>]) -> Problem {
    let wrote = changed.iter().rev().find(|changed| {
        paths.get(problem.span.file) == Some(&changed.file)
            && changed.start <= problem.span.start
            && problem.span.end <= changed.end
    });
    match wrote {
        Some(changed) => problem.note(&in_override(changed.order)),
        None => problem,
    }
}

/// Writes one override into the text of the file it belongs to, and notes where.
fn apply<'a>(
    order: &'a str,
    merged: &Merged,
    texts: &mut Texts,
    changed: &mut Vec<Changed<'a>>,
) -> Result<(), Problem> {
    let files = [SourceFile { name: "--set".to_owned(), folder: PathBuf::new(), text: order.to_owned() }];
    let refuse = |start: usize, end: usize, message: String| {
        Problem::new(ProblemKind::Override, message, Span { file: 0, start, end }, &files)
    };
    let Some((left, right)) = order.split_once('=') else {
        return Err(refuse(0, order.len(), format!("`--set {order}` has no `=`"))
            .help("write `--set path=value`, such as `--set strands[0].radius=0.004`"));
    };
    let value_start = left.len() + 1;
    if let Err(error) = parse(right, 0) {
        let mut problem = refuse(value_start + error.span.start, value_start + error.span.end, error.message);
        problem.help = error.help;
        return Err(
            problem.note("the value is written as in a scene file; texts keep their quotes: --set 'title=\"test\"'")
        );
    }
    let place = Path::parse(left).map_err(|message| {
        refuse(0, left.len(), message).help("write a path such as `strands[0].radius` or `materials.hair.density`")
    })?;
    let edit = edit_for(&merged.root, &place, right.trim()).map_err(|message| {
        let problem = refuse(0, left.len(), format!("`{left}` cannot be set: {message}"));
        match suggestion(&merged.root, &place) {
            Some(near) => problem.help(format!("did you mean `{near}`?")),
            None => problem.help("a path names fields from the scene inwards: `time.end`, `strands[0].radius`"),
        }
    })?;
    let file = &merged.paths[edit.span.file];
    if let Some(Ok(text)) = texts.get_mut(file)
        && text.get(edit.span.start..edit.span.end).is_some()
    {
        text.replace_range(edit.span.start..edit.span.end, &edit.text);
        // Text behind the edit moves.
        for other in changed.iter_mut().filter(|other| other.file == *file) {
            for place in [&mut other.start, &mut other.end] {
                if *place >= edit.span.end {
                    *place = *place - (edit.span.end - edit.span.start) + edit.text.len();
                }
            }
        }
        let end = edit.span.start + edit.text.len();
        changed.push(Changed { file: file.clone(), start: edit.span.start, end, order });
    }
    Ok(())
}

/// The nearest path that exists, for a path whose first missing step is misspelt.
fn suggestion(root: &Node, place: &Path) -> Option<String> {
    let (node, taken) = follow(root, place);
    let super::edit::Step::Name(wrong) = place.0.get(taken)? else { return None };
    let names: Vec<&str> = match &node.value {
        Value::Group(group) => group.fields.iter().map(|entry| entry.name.as_str()).collect(),
        Value::Map(entries) => entries
            .iter()
            .filter_map(|(key, _)| match &key.value {
                Value::Text(text) => Some(text.as_str()),
                _ => None,
            })
            .collect(),
        _ => return None,
    };
    let near = super::error::nearest(wrong, names)?;
    let mut steps = place.0.clone();
    steps[taken] = super::edit::Step::Name(near.to_owned());
    Some(Path(steps).to_string())
}

/// The unit system named in the scene; SI while it names none (which is refused later).
fn units_of(root: &Node) -> Units {
    let (node, taken) = follow(root, &Path::default().field("units"));
    match &node.value {
        Value::Name(name) if taken == 1 && name == "Cgs" => Units::Cgs,
        _ => Units::Si,
    }
}

/// Reads a scene and its included files and makes them one tree.
fn merge(path: &FilePath, texts: &mut Texts) -> Result<Merged, Vec<Problem>> {
    let mut merged = Merged { files: Vec::new(), paths: Vec::new(), root: Node::made(Value::Group(Group::default())) };
    let mut stack = Vec::new();
    merged.root = read_file(path, None, texts, &mut merged, &mut stack)?;
    Ok(merged)
}

fn read_file(
    path: &FilePath,
    included_at: Option<Span>,
    texts: &mut Texts,
    merged: &mut Merged,
    stack: &mut Vec<PathBuf>,
) -> Result<Node, Vec<Problem>> {
    let text = texts.entry(path.to_owned()).or_insert_with(|| read_text(path)).clone();
    let text = text.map_err(|error| {
        let span = included_at.unwrap_or(Span::NONE);
        let from = merged.files.get(span.file).map_or("the scene", |file| file.name.as_str());
        let message = format!("cannot read {}, which {from} includes: {error}", path.display());
        let problem = Problem::new(ProblemKind::File, message, span, &merged.files).at("include");
        vec![problem.help("the name is relative to the file that includes it")]
    })?;
    let file = merged.files.len();
    merged.files.push(SourceFile {
        name: path.display().to_string(),
        folder: path.parent().map(FilePath::to_owned).unwrap_or_default(),
        text: text.clone(),
    });
    merged.paths.push(path.to_owned());
    let mut root = parse(&text, file).map_err(|error| vec![Problem::syntax(error, &merged.files)])?;
    agree_with_ron(&text, &root, file, &merged.files)?;

    stack.push(path.to_owned());
    let folder = merged.files[file].folder.clone();
    for (name, span) in includes(&root) {
        let target = folder.join(&name);
        let known = identity(&target);
        if stack.iter().any(|file| identity(file) == known) {
            let mut chain = String::new();
            for file in stack.iter().chain([&target]) {
                let _ = write!(chain, "{}{}", if chain.is_empty() { "" } else { " → " }, file.display());
            }
            let problem =
                Problem::new(ProblemKind::File, format!("{name} includes itself: {chain}"), span, &merged.files);
            return Err(vec![problem.at("include").help("remove one of these `include` entries")]);
        }
        if merged.paths.iter().any(|file| identity(file) == known) {
            continue; // included by another file already: once is enough
        }
        let other = read_file(&target, Some(span), texts, merged, stack)?;
        join(&mut root, other, span, &merged.files)?;
    }
    stack.pop();
    Ok(root)
}

/// Lets the `ron` crate judge the syntax, so that scene files are RON and nothing looser. The one form that plain RON
/// does not have (a first value without its name) is left to our reader.
fn agree_with_ron(text: &str, root: &Node, file: usize, files: &[SourceFile]) -> Result<(), Vec<Problem>> {
    if root.has_mixed_group() {
        return Ok(());
    }
    let extensions = ron::extensions::Extensions::IMPLICIT_SOME | ron::extensions::Extensions::UNWRAP_NEWTYPES;
    let options = ron::Options::default().with_default_extension(extensions);
    let Err(error) = options.from_str::<serde::de::IgnoredAny>(text) else { return Ok(()) };
    let position = error.span.start;
    let line_start: usize = text.split_inclusive('\n').take(position.line.saturating_sub(1)).map(str::len).sum();
    let line = text.get(line_start..).unwrap_or("");
    let column: usize = line.chars().take(position.col.saturating_sub(1)).map(char::len_utf8).sum();
    let start = (line_start + column).min(text.len());
    let length = text.get(start..).and_then(|rest| rest.chars().next()).map_or(0, char::len_utf8);
    let span = Span { file, start, end: start + length };
    let problem = Problem::new(ProblemKind::Syntax, format!("this is not valid RON: {}", error.code), span, files);
    Err(vec![problem.help("scene files are RON: https://docs.rs/ron")])
}

/// The file names in `include`, as far as they are texts; anything else is refused when the scene is decoded.
fn includes(root: &Node) -> Vec<(String, Span)> {
    let (node, taken) = follow(root, &Path::default().field("include"));
    match &node.value {
        Value::List(items) if taken == 1 => items
            .iter()
            .filter_map(|item| match &item.value {
                Value::Text(name) => Some((name.clone(), item.span)),
                _ => None,
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// Joins an included file to the scene: lists are appended, maps are united, and where both say something the scene wins.
fn join(root: &mut Node, other: Node, included_at: Span, files: &[SourceFile]) -> Result<(), Vec<Problem>> {
    let other_span = other.span;
    let (Value::Group(root), Value::Group(other)) = (&mut root.value, other.value) else {
        let problem =
            Problem::new(ProblemKind::Type, "an included file must be a scene, `Scene(…)`", other_span, files);
        return Err(vec![problem.at("include").help("write `Scene(materials: {…}, …)`: the fields to add")]);
    };
    for Entry { name, name_span, value } in other.fields {
        let mine = root.fields.iter_mut().find(|entry| entry.name == name);
        match mine {
            _ if name == "include" => {}
            None if name == "units" => {}
            Some(mine) if name == "units" => {
                if let (Value::Name(own), Value::Name(its)) = (&mine.value.value, &value.value)
                    && own != its
                {
                    let file = files.get(included_at.file).map_or("the scene", |file| file.name.as_str());
                    let message = format!("this file is in `{its}`, but {file}, which includes it, is in `{own}`");
                    let problem = Problem::new(ProblemKind::Inconsistent, message, value.span, files);
                    return Err(vec![
                        problem.at("units").help("included files use the units of the scene that includes them"),
                    ]);
                }
            }
            None => root.fields.push(Entry { name, name_span, value }),
            Some(mine) => match (&mut mine.value.value, value.value) {
                (Value::List(mine), Value::List(its)) => mine.extend(its),
                (Value::Map(mine), Value::Map(its)) => {
                    for (key, value) in its {
                        if !mine.iter().any(|(own, _)| own.value == key.value) {
                            mine.push((key, value));
                        }
                    }
                }
                _ => {}
            },
        }
    }
    Ok(())
}

/// One text for a scene of several files: no `include`, and file names relative to the scene's own folder.
fn merged_text(merged: &Merged) -> String {
    let mut root = merged.root.clone();
    if let Value::Group(group) = &mut root.value {
        group.fields.retain(|entry| entry.name != "include");
    }
    relocate(&mut root, &merged.files);
    let names: Vec<&str> = merged.files.iter().map(|file| file.name.as_str()).collect();
    format!("// Merged from {}\n{}", names.join(", "), write(&root))
}

/// Rewrites the `file: "…"` entries of included files so that they are right seen from the scene's folder.
fn relocate(node: &mut Node, files: &[SourceFile]) {
    match &mut node.value {
        Value::List(items) => items.iter_mut().for_each(|item| relocate(item, files)),
        Value::Map(entries) => entries.iter_mut().for_each(|(_, value)| relocate(value, files)),
        Value::Group(group) => {
            let from_file = matches!(&group.name, Some((name, _)) if name == "Obj" || name == "Mesh" || name == "File");
            if from_file && let Some(first) = group.items.first_mut() {
                relocate_name(first, files);
            }
            for entry in &mut group.fields {
                if entry.name == "file" {
                    relocate_name(&mut entry.value, files)
                } else {
                    relocate(&mut entry.value, files)
                }
            }
            group.items.iter_mut().for_each(|item| relocate(item, files));
        }
        _ => {}
    }
}

fn relocate_name(node: &mut Node, files: &[SourceFile]) {
    let (Value::Text(name), Some(file), Some(main)) = (&mut node.value, files.get(node.span.file), files.first())
    else {
        return;
    };
    if file.folder == main.folder || FilePath::new(name.as_str()).is_absolute() {
        return;
    }
    // Included names are joined to the including folder, so the main folder is a prefix of all but absolute ones.
    let folder = file.folder.strip_prefix(&main.folder).unwrap_or(&file.folder);
    *name = folder.join(&name).to_string_lossy().into_owned();
}

/// FNV-1a over the bytes, as 16 hexadecimal digits.
#[must_use]
pub fn hash(text: &str) -> String {
    let value = text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{value:016x}")
}
