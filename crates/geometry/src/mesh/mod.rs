//! Closed triangle meshes with signed distance.
//!
//! Loading welds vertices, drops triangles without area and refuses what has no inside (open, not manifold, inconsistently
//! turned). Distance goes through parry's bounding-volume tree; the sign comes from angle-weighted pseudo-normals.

mod load;

use crate::shape::SurfaceSample;
use crate::{Aabb, Vector3};
use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use std::collections::HashMap;
use std::path::PathBuf;
use thiserror::Error;

/// Nearer to the surface than this fraction of the mesh's size the direction to the nearest point is round-off, and the normal of its triangle is used.
const ON_SURFACE: f64 = 1e-7;

/// A closed surface of triangles that face outward.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    surface: TriMesh,
    bounds: Aabb,
    centroid: Vector3,
    volume: f64,
    size: f64,
    report: MeshReport,
}

/// What was mended on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Vertices that lay on others.
    pub welded_vertices: usize,
    /// Triangles without area.
    pub dropped_triangles: usize,
    /// Whether all triangles faced inward and were turned round.
    pub turned_round: bool,
}

/// Why a mesh cannot be used as a solid.
#[derive(Debug, Error)]
pub enum MeshError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", file.display())]
    Read {
        /// File.
        file: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The file is not what its name says.
    #[error("{}: {message}", file.display())]
    Format {
        /// File.
        file: PathBuf,
        /// Why.
        message: String,
    },
    /// Only `.obj` and `.stl` are read.
    #[error("{}: unknown kind of mesh file, wanted .obj or .stl", file.display())]
    Kind {
        /// File.
        file: PathBuf,
    },
    /// A vertex is not finite.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Which vertex, from zero.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex} of {count}")]
    Index {
        /// Which triangle, from zero.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        count: usize,
    },
    /// No triangle with area.
    #[error("the mesh has no triangle with area")]
    Empty,
    /// The surface has a rim, so nothing is inside.
    #[error("the mesh is not closed: {edges} edges have a triangle on one side only, first between {} and {}", show(.from), show(.to))]
    Open {
        /// How many edges.
        edges: usize,
        /// One end of the first such edge [m].
        from: [f64; 3],
        /// Its other end [m].
        to: [f64; 3],
    },
    /// Neighbouring triangles face different ways, or more than two share an edge.
    #[error("triangles disagree about what is outside (or more than two share an edge) at {edges} edges, first between {} and {}", show(.from), show(.to))]
    NotOriented {
        /// How many edges.
        edges: usize,
        /// One end of the first such edge [m].
        from: [f64; 3],
        /// Its other end [m].
        to: [f64; 3],
    },
    /// The distance tree cannot be built.
    #[error("the mesh cannot be indexed: {message}")]
    Tree {
        /// Why.
        message: String,
    },
}

fn show(p: &[f64; 3]) -> String {
    format!("({:.6}, {:.6}, {:.6})", p[0], p[1], p[2])
}

impl TriangleMesh {
    /// A mesh from vertices [m] and triangles.
    ///
    /// # Errors
    /// [`MeshError`] if a number is not finite, an index is wrong or the surface has no inside.
    pub fn new(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<TriangleMesh, MeshError> {
        if let Some(vertex) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(MeshError::Index { triangle, vertex, count: vertices.len() });
            }
        }
        let mut report = MeshReport::default();
        let (points, number) = weld(vertices);
        report.welded_vertices = vertices.len() - points.len();
        let area_vector = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| Vector3::from(points[v as usize]));
            ((b - a).cross(&(c - a)), (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared()))
        };
        let mut faces: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| number[v as usize])).collect();
        faces.retain(|t| {
            let (area, side) = area_vector(t);
            t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && area.norm() > 1e-14 * side
        });
        report.dropped_triangles = triangles.len() - faces.len();
        if faces.is_empty() {
            return Err(MeshError::Empty);
        }
        check_closed(&points, &faces)?;

        let bounds = faces.iter().flatten().fold(Aabb::EMPTY, |mut all, &v| {
            all.include(&points[v as usize].into());
            all
        });
        let middle = bounds.center();
        // Tetrahedra to the middle of the box: small numbers, so that far-away meshes keep their digits.
        let (mut volume, mut moment) = (0.0, Vector3::zeros());
        for t in &faces {
            let [a, b, c] = t.map(|v| Vector3::from(points[v as usize]) - middle);
            let part = a.dot(&b.cross(&c)) / 6.0;
            volume += part;
            moment += (a + b + c) * (part / 4.0);
        }
        if volume < 0.0 {
            faces.iter_mut().for_each(|t| t.swap(1, 2));
            report.turned_round = true;
        }
        let centroid = if volume == 0.0 { middle } else { middle + moment / volume };
        let size = Vector3::from_fn(|k, _| bounds.max[k] - bounds.min[k]).norm();
        let points = points.iter().map(|p| ParryVector::new(p[0], p[1], p[2])).collect();
        let surface = TriMesh::with_flags(points, faces, TriMeshFlags::ORIENTED)
            .map_err(|error| MeshError::Tree { message: error.to_string() })?;
        Ok(TriangleMesh { surface, bounds, centroid, volume: volume.abs(), size, report })
    }

    /// Signed distance [m] and outward unit normal of the nearest surface point.
    #[must_use]
    pub fn sample(&self, point: &Vector3) -> SurfaceSample {
        let query = ParryVector::new(point.x, point.y, point.z);
        let (projection, (triangle, _)) = self.surface.project_local_point_and_get_location(query, false);
        let nearest = Vector3::new(projection.point.x, projection.point.y, projection.point.z);
        let offset = point - nearest;
        let length = offset.norm();
        let sign = if projection.is_inside { -1.0 } else { 1.0 };
        let normal = if length > ON_SURFACE * self.size {
            offset * (sign / length)
        } else {
            let [a, b, c] = self.surface.indices()[triangle as usize].map(|v| {
                let p = self.surface.vertices()[v as usize];
                Vector3::new(p.x, p.y, p.z)
            });
            (b - a).cross(&(c - a)).normalize()
        };
        SurfaceSample { distance: sign * length, normal }
    }

    /// Smallest box around the mesh.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Centre of the enclosed volume [m].
    #[must_use]
    pub fn centroid(&self) -> Vector3 {
        self.centroid
    }

    /// Enclosed volume [m³].
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// What was mended when the mesh was made.
    #[must_use]
    pub fn report(&self) -> MeshReport {
        self.report
    }

    /// Vertices [m].
    #[must_use]
    pub fn positions(&self) -> Vec<Vector3> {
        self.surface.vertices().iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect()
    }

    /// Triangles, counter-clockwise seen from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.surface.indices()
    }
}

/// Vertices with equal coordinates become one; returns the distinct ones and the new number of each old one.
fn weld(vertices: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<u32>) {
    let mut distinct: HashMap<[u64; 3], u32> = HashMap::with_capacity(vertices.len());
    let mut points = Vec::new();
    let number = vertices
        .iter()
        .map(|v| {
            // Adding zero makes the two zeros one.
            *distinct.entry(v.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                points.push(*v);
                points.len() as u32 - 1
            })
        })
        .collect();
    (points, number)
}

/// Every edge must be walked once in each direction.
fn check_closed(points: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<(), MeshError> {
    let mut walks: Vec<(u32, u32, bool)> = faces
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
        .map(|(a, b)| (a.min(b), a.max(b), a < b))
        .collect();
    walks.sort_unstable();
    let (mut open, mut odd) = (Vec::new(), Vec::new());
    for edge in walks.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let forward = edge.iter().filter(|walk| walk.2).count();
        match (forward, edge.len() - forward) {
            (1, 1) => {}
            (1, 0) | (0, 1) => open.push((edge[0].0, edge[0].1)),
            _ => odd.push((edge[0].0, edge[0].1)),
        }
    }
    let ends = |edge: &(u32, u32)| (points[edge.0 as usize], points[edge.1 as usize]);
    if let Some((from, to)) = odd.first().map(ends) {
        return Err(MeshError::NotOriented { edges: odd.len(), from, to });
    }
    if let Some((from, to)) = open.first().map(ends) {
        return Err(MeshError::Open { edges: open.len(), from, to });
    }
    Ok(())
}
