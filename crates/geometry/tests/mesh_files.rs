//! Mesh files: good ones load, bad ones are refused with a reason and never panic.

use geometry::{MeshError, Pose, TriangleMesh, Vector3};
use std::fs;
use std::path::PathBuf;

const CUBE: &str = "# unit cube
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn write(name: &str, bytes: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    fs::write(&file, bytes).unwrap();
    (folder, file)
}

fn load(name: &str, bytes: impl AsRef<[u8]>) -> Result<TriangleMesh, MeshError> {
    let (_folder, file) = write(name, bytes);
    TriangleMesh::load(&file, &Pose::identity())
}

fn binary_stl(mesh: &TriangleMesh, claimed: u32) -> Vec<u8> {
    let mut bytes = vec![0u8; 80];
    bytes.extend(claimed.to_le_bytes());
    let positions = mesh.positions();
    for t in mesh.triangles() {
        bytes.extend([0u8; 12]);
        for v in t {
            positions[*v as usize].iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        }
        bytes.extend([0u8; 2]);
    }
    bytes
}

#[test]
fn obj_and_stl_give_the_same_cube() {
    let cube = load("cube.obj", CUBE).unwrap();
    assert!((cube.volume() - 1.0).abs() < 1e-15);
    assert!((cube.sample(&Vector3::new(0.5, 0.5, 1.5)).distance - 0.5).abs() < 1e-15);
    let soup = load("cube.stl", binary_stl(&cube, 12)).unwrap();
    assert!((soup.volume() - 1.0).abs() < 1e-15);
    assert_eq!(soup.report().welded_vertices, 36 - 8);
    let placed = {
        let (_folder, file) = write("cube.obj", CUBE);
        let pose = Pose { scale: 2.0, translation: Vector3::new(5.0, 0.0, 0.0), ..Pose::identity() };
        TriangleMesh::load(&file, &pose).unwrap()
    };
    assert!((placed.volume() - 8.0).abs() < 1e-12 && (placed.centroid() - Vector3::new(6.0, 1.0, 1.0)).norm() < 1e-12);
}

#[test]
fn precision_of_obj_is_not_cut_to_single() {
    let cube = load("cube.obj", CUBE.replace("v 0 0 0", "v 0.0000001234567890123 0 0")).unwrap();
    assert!(cube.positions().iter().any(|p| p.x == 0.0000001234567890123));
}

#[test]
fn inside_out_cube_is_turned_round() {
    let inside_out = CUBE.lines().map(|line| match line.strip_prefix("f ") {
        Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    });
    let cube = load("cube.obj", inside_out.collect::<String>()).unwrap();
    assert!(cube.report().turned_round && cube.sample(&Vector3::repeat(0.5)).distance < 0.0);
}

#[test]
fn bad_meshes_are_refused_with_a_reason() {
    let refused = |name: &str, text: &str| load(name, text).unwrap_err();
    assert!(matches!(refused("a.obj", &CUBE.replace("f 4 1 5 8\n", "")), MeshError::Open { edges: 4, .. }));
    assert!(matches!(refused("a.obj", &CUBE.replace("f 4 1 5 8", "f 8 5 1 4")), MeshError::NotOriented { .. }));
    assert!(matches!(
        refused("a.obj", &CUBE.replace("v 1 1 1", "v 1 NaN 1")),
        MeshError::NotFinite { .. } | MeshError::Format { .. }
    ));
    assert!(matches!(refused("a.obj", "v 0 0 0\nf 1 1 1\n"), MeshError::Empty));
    assert!(matches!(refused("a.obj", ""), MeshError::Empty));
    assert!(matches!(refused("a.ply", CUBE), MeshError::Kind { .. }));
    assert!(matches!(TriangleMesh::new(&[[0.0; 3]], &[[0, 1, 2]]), Err(MeshError::Index { vertex: 1, .. })));
    for text in [
        "f 1 2 3\n",
        "v 0 0\nf 1 2 3\n",
        "v 0 0 0\nf 1 2 999999999999\n",
        "v 0 0 0\nf -5 -6 -7\n",
        "f 0 0 0\n",
        "v a b c\n",
    ] {
        let _ = refused("a.obj", text);
    }
    let cube = load("cube.obj", CUBE).unwrap();
    let bytes = binary_stl(&cube, 12);
    assert!(load("a.stl", &bytes[..200]).is_err());
    assert!(load("a.stl", binary_stl(&cube, u32::MAX)).is_err());
    assert!(load("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0").is_err());
    assert!(load("a.stl", []).is_err());
    assert!(TriangleMesh::load(&PathBuf::from("does-not-exist.obj"), &Pose::identity()).is_err());
}
