//! Cuts through a cross-linked sample.

use super::Cut;
use crate::assembly::Assembly;
use crate::random::Random;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A Voronoi point or one of its images.
struct Site {
    position: Point2<f64>,
    owner: u32,
}

impl HasPosition for Site {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Cuts the links of a sample as the settings say. Links between grains of different Voronoi cells, or crossed by a line, go.
pub fn cut_into_particles(assembly: &mut Assembly, cut: &Cut, top_and_bottom: bool, random: &mut Random) {
    if top_and_bottom {
        let height = assembly.cell().height;
        for y in [0.0, height] {
            cut_line(assembly, [0.0, y], [0.0, 1.0]);
        }
    }
    match *cut {
        Cut::None => {}
        Cut::Voronoi { points, edge_fuzziness } if points > 1 => {
            let owner = voronoi(assembly, points, edge_fuzziness, random);
            for [i, j] in assembly.links() {
                if owner[i] != owner[j] {
                    assembly.cut(i, j);
                }
            }
        }
        Cut::Voronoi { .. } => {}
        Cut::Lines { count, avoid_horizontal } => {
            for _ in 0..count {
                let (width, height) = (assembly.cell().width, assembly.cell().height);
                let point = [(random.uniform() * width).floor(), (random.uniform() * height).floor()];
                // Angle of the normal; near 90 or 270 degrees the cut is close to horizontal.
                let angle = loop {
                    let degrees = 360.0 * random.uniform();
                    let off = |upright: f64| (degrees - upright).abs() < avoid_horizontal;
                    if !off(90.0) && !off(270.0) {
                        break degrees.to_radians();
                    }
                };
                cut_line(assembly, point, [angle.cos(), angle.sin()]);
            }
        }
    }
}

fn cut_line(assembly: &mut Assembly, point: [f64; 2], normal: [f64; 2]) {
    let grains = assembly.grains();
    let height_above = |p: [f64; 2]| (p[0] - point[0]) * normal[0] + (p[1] - point[1]) * normal[1];
    for [i, j] in assembly.links() {
        let (s, ..) = assembly.cell().nearest(grains.x[j] - grains.x[i], grains.y[j] - grains.y[i]);
        let a = height_above([grains.x[i], grains.y[i]]);
        let b = height_above([grains.x[i] + s[0], grains.y[i] + s[1]]);
        if a * b <= 0.0 {
            assembly.cut(i, j);
        }
    }
}

/// Number of the nearest point for each grain; ties go to the first point.
fn voronoi(assembly: &Assembly, points: usize, fuzziness: f64, random: &mut Random) -> Vec<u32> {
    if let Assembly::Spheres(s) = assembly {
        return voronoi_of_spheres(s, points, fuzziness, random);
    }
    let (grains, cell) = (assembly.grains(), *assembly.cell());
    let sites: Vec<[f64; 2]> =
        (0..points).map(|_| [random.uniform() * cell.width, random.uniform() * cell.height]).collect();
    if points > 32 && fuzziness == 0.0 && cell.boundary.periodic_y() {
        return nearest_by_triangulation(&grains.x, &grains.y, &sites, &cell);
    }
    let largest = grains.radius.iter().fold(0.0f64, |m, &r| m.max(r));
    (0..grains.len())
        .map(|i| {
            let mut best = (f64::MAX, 0);
            for (k, s) in sites.iter().enumerate() {
                let ([dx, dy], ..) = cell.nearest(s[0] - grains.x[i], s[1] - grains.y[i]);
                let noise = if fuzziness > 0.0 { fuzziness * random.uniform() * largest } else { 0.0 };
                let distance = (dx * dx + dy * dy).sqrt() + noise;
                if distance < best.0 {
                    best = (distance, k as u32);
                }
            }
            best.1
        })
        .collect()
}

/// Nearest point in space for each sphere.
fn voronoi_of_spheres(
    s: &crate::spheres::SphereSample,
    points: usize,
    fuzziness: f64,
    random: &mut Random,
) -> Vec<u32> {
    let (cell, depth) = (s.cell, s.depth());
    let sites: Vec<[f64; 3]> = (0..points)
        .map(|_| [random.uniform() * cell.width, random.uniform() * cell.height, random.uniform() * depth])
        .collect();
    let largest = s.balls().iter().fold(0.0f64, |m, b| m.max(b.radius));
    s.balls()
        .iter()
        .map(|b| {
            let mut best = (f64::MAX, 0);
            for (k, site) in sites.iter().enumerate() {
                let ([dx, dy], ..) = cell.nearest(site[0] - b.position[0], site[1] - b.position[1]);
                let z = site[2] - b.position[2];
                let dz = z - (z / depth).round() * depth;
                let noise = if fuzziness > 0.0 { fuzziness * random.uniform() * largest } else { 0.0 };
                let distance = (dx * dx + dy * dy + dz * dz).sqrt() + noise;
                if distance < best.0 {
                    best = (distance, k as u32);
                }
            }
            best.1
        })
        .collect()
}

/// The same through a Delaunay triangulation of the points and their images around the box: logarithmic per grain.
fn nearest_by_triangulation(x: &[f64], y: &[f64], sites: &[[f64; 2]], cell: &crate::cell::Cell) -> Vec<u32> {
    let turn = cell.width / cell.height;
    let slope = cell.strain - (cell.strain / turn).round() * turn;
    let mut all = Vec::with_capacity(sites.len() * 15);
    for (owner, s) in sites.iter().enumerate() {
        for row in -1..=1 {
            for column in -2..=2 {
                let (r, c) = (f64::from(row), f64::from(column));
                all.push(Site {
                    position: Point2::new(s[0] + c * cell.width + r * cell.height * slope, s[1] + r * cell.height),
                    owner: owner as u32,
                });
            }
        }
    }
    let Ok(net) = DelaunayTriangulation::<Site>::bulk_load(all) else { return vec![0; x.len()] };
    (0..x.len()).map(|i| net.nearest_neighbor(Point2::new(x[i], y[i])).map_or(0, |v| v.data().owner)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Cell;

    #[test]
    fn triangulated_search_finds_the_nearest_image() {
        let mut random = Random::new(3);
        let mut cell = Cell::new(500.0, 400.0);
        cell.strain = 0.37;
        let sites: Vec<[f64; 2]> = (0..60).map(|_| [random.uniform() * 500.0, random.uniform() * 400.0]).collect();
        let x: Vec<f64> = (0..500).map(|_| random.uniform() * 500.0).collect();
        let y: Vec<f64> = (0..500).map(|_| random.uniform() * 400.0).collect();
        let found = nearest_by_triangulation(&x, &y, &sites, &cell);
        for i in 0..500 {
            let distance = |s: &[f64; 2]| {
                let ([dx, dy], ..) = cell.nearest(s[0] - x[i], s[1] - y[i]);
                dx.hypot(dy)
            };
            let best = sites.iter().map(distance).fold(f64::MAX, f64::min);
            assert!((distance(&sites[found[i] as usize]) - best).abs() < 1e-9);
        }
    }
}
