//! Meshes from OBJ and STL files.

use super::{MeshError, TriangleMesh};
use crate::Pose;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

impl TriangleMesh {
    /// Loads an OBJ or STL file (by its extension) and places it.
    ///
    /// Polygons are split into triangles; materials, normals and texture coordinates are left aside.
    ///
    /// # Errors
    /// [`MeshError`] if the file cannot be read or is not a closed surface.
    pub fn load(file: &Path, pose: &Pose) -> Result<TriangleMesh, MeshError> {
        let kind = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let open =
            || File::open(file).map(BufReader::new).map_err(|source| MeshError::Read { file: file.to_owned(), source });
        let (mut vertices, triangles) = match kind.as_deref() {
            Some("obj") => read_obj(&mut open()?, file)?,
            Some("stl") => read_stl(&mut open()?, file)?,
            _ => return Err(MeshError::Kind { file: file.to_owned() }),
        };
        vertices.iter_mut().for_each(|v| *v = pose.apply(&(*v).into()).into());
        TriangleMesh::new(&vertices, &triangles)
    }
}

type Soup = (Vec<[f64; 3]>, Vec<[u32; 3]>);

fn read_obj(from: &mut BufReader<File>, file: &Path) -> Result<Soup, MeshError> {
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(from, &options, no_materials)
        .map_err(|error| MeshError::Format { file: file.to_owned(), message: error.to_string() })?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for model in &models {
        let base = vertices.len() as u32;
        vertices.extend(model.mesh.positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
        triangles
            .extend(model.mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|v| v.saturating_add(base))));
    }
    Ok((vertices, triangles))
}

fn read_stl(from: &mut BufReader<File>, file: &Path) -> Result<Soup, MeshError> {
    let refuse = |error: std::io::Error| MeshError::Format { file: file.to_owned(), message: error.to_string() };
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // One triangle at a time: the count in the header of a broken file must not be trusted with memory.
    for triangle in stl_io::create_stl_reader(from).map_err(refuse)? {
        let triangle = triangle.map_err(refuse)?;
        let base = vertices.len() as u32;
        vertices.extend(triangle.vertices.iter().map(|v| v.0.map(f64::from)));
        triangles.push([base, base + 1, base + 2]);
    }
    Ok((vertices, triangles))
}
