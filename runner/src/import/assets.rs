//! Finding the files that a foreign scene names, and naming them from where the new scene will be.

use std::path::{Component, Path, PathBuf};

/// Looks for a file that the original would look for from its working directory: in the folders given, beside the scene
/// file, in every folder above it, and in the working directory.
#[must_use]
pub fn find(name: &str, scene: &Path, folders: &[PathBuf]) -> Option<PathBuf> {
    let name = PathBuf::from(name.replace('\\', "/"));
    if name.is_absolute() {
        return name.is_file().then_some(name);
    }
    let beside = scene.parent().map(absolute).unwrap_or_default();
    let candidates = folders
        .iter()
        .map(PathBuf::as_path)
        .chain(beside.ancestors())
        .map(|folder| folder.join(&name))
        .chain(folders.iter().filter_map(|folder| Some(folder.join(name.file_name()?))))
        .chain([name.clone()]);
    candidates.into_iter().find(|path| path.is_file())
}

/// The path of a file as seen from a folder, with `/` between its parts.
#[must_use]
pub fn relative(file: &Path, folder: &Path) -> String {
    let (file, folder) = (absolute(file), absolute(folder));
    let (there, here): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (file.components().collect(), folder.components().collect());
    let common = there.iter().zip(&here).take_while(|(a, b)| a == b).count();
    if common <= 1 {
        // nothing in common but the root: the whole path says more than a row of dots
        return file.display().to_string();
    }
    let up = std::iter::repeat_n("..".to_owned(), here.len() - common);
    let down = there[common..].iter().map(|part| part.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}

fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    std::fs::canonicalize(path).or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_beside_above_and_in_given_folders() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        std::fs::create_dir_all(at("a/b")).unwrap();
        std::fs::create_dir_all(at("assets")).unwrap();
        std::fs::create_dir_all(at("other")).unwrap();
        for file in ["assets/x.obj", "a/b/y.obj", "other/z.obj"] {
            std::fs::write(at(file), "").unwrap();
        }
        let scene = at("a/b/scene.xml");
        let found = |name: &str| find(name, &scene, &[at("other")]).map(|path| relative(&path, &at("a")));
        assert_eq!(found("assets/x.obj").as_deref(), Some("../assets/x.obj"));
        assert_eq!(found("y.obj").as_deref(), Some("b/y.obj"));
        assert_eq!(found("assets\\z.obj").as_deref(), Some("../other/z.obj"));
        assert_eq!(found("no.obj"), None);
        let whole = at("assets/x.obj");
        assert_eq!(find(whole.to_str().unwrap(), &scene, &[]), Some(whole.clone()));
    }
}
